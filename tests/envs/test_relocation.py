"""The learning environment: its rules on drawn maps, the oracle's answers carried out in it,
gymnax's form.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax import check, envs, make_task, perturbed, shortest_path, solve, stack, unstack
from srt_jax.envs.rules import act
from srt_jax.instances.generate import generate
from srt_jax.moves import MOVES
from srt_jax.reference.dijkstra import dijkstra
from tests.helpers.pictures import drawn

EAST, SOUTH_EAST, NORTH = (MOVES.index(move) for move in ((0, 1), (1, 1), (-1, 0)))
DESTROY = len(MOVES)


@functools.cache
def pool():
    """Levels of every kind that has a solution, with the solutions."""
    tasks = [
        task
        for kind in ("rooms", "mixed")
        for _, task, _ in generate(kind, count=28, size=16, seed=3)
    ]
    levels = envs.make_levels(tasks)
    return levels, solve(envs.to_tasks(levels), max_destroyed=32)


def on(picture, letters="", **options):
    """One level from a picture: letters are obstacles by their place in `letters`, S and G the
    ends.
    """
    free, places = drawn(picture)
    labels = np.where(free, -1, len(letters)).astype(np.int32)
    for row, line in enumerate(picture.split()):
        for col, sign in enumerate(line):
            labels[row, col] = letters.index(sign) if sign in letters else labels[row, col]
    task = make_task(labels, places["S"], places["G"], destroyable=range(len(letters)), **options)
    env, params = envs.make(levels=envs.make_levels([task], oracle=False), radius=2)
    return env, params, env.reset(jax.random.key(0), params)[1]


def test_moves_cost_their_length_and_blocked_ones_change_nothing():
    env, params, state = on("S.@G\n....\n....")
    key = jax.random.key(0)
    _, moved, reward, _, info = env.step_env(key, state, EAST, params)
    assert moved.cell.tolist() == [0, 1] and info["length"] == 1 and reward == pytest.approx(-0.01)
    _, stuck, reward, _, _ = env.step_env(key, moved, EAST, params)
    assert stuck.cell.tolist() == [0, 1] and reward == pytest.approx(-params.wasted_cost)
    _, corner, *_ = env.step_env(key, moved, SOUTH_EAST, params)
    assert corner.cell.tolist() == [0, 1], "a diagonal cuts no corner"
    _, outside, *_ = env.step_env(key, moved, NORTH, params)
    assert outside.cell.tolist() == [0, 1]


def test_destroying_takes_what_is_in_the_way_of_the_move_and_is_paid_once_each():
    env, params, state = on("SA.\nBAG\n...", letters="AB", removal_cost=[2.0, 3.0, 1.0])
    _, east, *_ = env.step_env(jax.random.key(0), state, DESTROY + EAST, params)
    assert east.removal == 2 and int(east.gone[0]) == 0b01
    _, both, *_ = env.step_env(jax.random.key(0), state, DESTROY + SOUTH_EAST, params)
    assert both.removal == 5 and int(both.gone[0]) == 0b11
    _, again, reward, *_ = env.step_env(jax.random.key(0), both, DESTROY + SOUTH_EAST, params)
    assert again.removal == 5 and reward == pytest.approx(-params.wasted_cost)
    _, moved, *_ = env.step_env(jax.random.key(0), both, SOUTH_EAST, params)
    assert moved.cell.tolist() == [1, 1]


def test_what_cannot_be_destroyed_stays():
    env, params, state = on("S@.\n..G")
    _, after, *_ = env.step_env(jax.random.key(0), state, DESTROY + EAST, params)
    assert after.removal == 0 and int(after.gone[0]) == 0
    assert not env.action_mask(state, params)[DESTROY + EAST]


def test_the_actions_carry_out_every_answer_of_the_oracle_at_its_own_cost():
    levels, solution = pool()
    actions = envs.oracle_actions(solution)
    env, params = envs.make(levels=levels)

    @jax.jit
    def replayed(level, actions):
        def step(state, action):
            mask = env.action_mask(state, params)
            new = env.step_env(jax.random.key(0), state, jnp.maximum(action, 0), params)[1]
            return jax.tree.map(lambda a, b: jnp.where(action >= 0, a, b), new, state), mask[
                action
            ] | (action < 0)

        return jax.lax.scan(step, env.reset_to(level, params)[1], actions)

    numbers = jnp.arange(len(actions), dtype=jnp.int32)
    state, had_effect = jax.vmap(replayed)(numbers, jnp.asarray(actions))
    assert len(actions) > 35 and (solution.num_destroyed > 1).sum() > 5
    assert had_effect.all()
    np.testing.assert_array_equal(state.cell, levels.goal)
    np.testing.assert_allclose(state.length, levels.length, rtol=1e-5)
    np.testing.assert_allclose(state.removal, levels.removal, rtol=1e-6)
    regret = envs.relocation.oracle_score(params) - state.score
    np.testing.assert_allclose(regret, 0, atol=1e-4)


def test_more_than_one_word_of_obstacles_is_kept_apart():
    labels = np.full((3, 80), -1, np.int32)
    labels[:, 1::2] = np.arange(40)[None]
    env, params = envs.make(
        levels=envs.make_levels([make_task(labels, (1, 0), (1, 79))], oracle=False)
    )
    _, state = env.reset(jax.random.key(0), params)
    step = jax.jit(env.step_env)
    for _ in range(79):
        for action in (DESTROY + EAST, EAST):
            _, state, *_ = step(jax.random.key(0), state, jnp.int32(action), params)
    assert state.removal == 40 and state.cell.tolist() == [1, 79]
    assert state.gone.tolist() == [2**32 - 1, 2**8 - 1]


def test_the_end_of_an_episode_is_reported_and_the_next_begins():
    env, params, state = on("S.G")
    params = params.replace(
        levels=params.levels.replace(removal=jnp.zeros(1), length=jnp.full(1, 2.0))
    )
    _, state, *_ = env.step(jax.random.key(0), state, EAST, params)
    seen, state, reward, terminated, truncated, info = env.step(
        jax.random.key(1), state, EAST, params
    )
    assert terminated and not truncated and info["success"] and info["discount"] == 0
    assert reward == pytest.approx(10 - 0.01) and info["regret"] == pytest.approx(0, abs=1e-5)
    assert state.cell.tolist() == [0, 0] and state.time == 0 and state.score == 0
    assert info["final_observation"][2, 2, 3] == 1, "the agent stands on the goal"
    np.testing.assert_array_equal(seen, env.get_obs(state, params))


def test_time_that_is_up_truncates_and_does_not_terminate():
    env, params, state = on("S.G")
    params = params.replace(max_steps_in_episode=1)
    _, state, _, terminated, truncated, info = env.step(jax.random.key(0), state, EAST, params)
    assert truncated and not terminated and info["discount"] == 1 and state.time == 0


def test_the_window_shows_what_is_around_and_the_map_shows_all():
    env, params, state = on("SA.\n..@\n.G.", letters="A", removal_cost=[2.0, 1.0])
    window = np.asarray(env.get_obs(state, params))
    assert window.shape == env.observation_space(params).shape == (5, 5, 6)
    np.testing.assert_array_equal(window[2:, 2:, 0], [[0, 0, 0], [0, 0, 1], [0, 0, 0]])
    assert window[:2, :, 0].all() and window[:, :2, 0].all(), "outside the map is fixed"
    assert window[2, 3, 1] == 1 and window[2, 3, 2] == 2 and window[..., 1].sum() == 1
    assert (
        window[4, 3, 3] == 1
        and window[0, 0, 4] == pytest.approx(2 / 3)
        and window[0, 0, 5] == pytest.approx(1 / 3)
    )
    whole = np.asarray(envs.SmartRelocation(observation="map").get_obs(state, params))
    np.testing.assert_array_equal(whole[..., 0], [[0, 0, 0], [0, 0, 1], [0, 0, 0]])
    assert whole[0, 0, 3] == 1 and whole[2, 1, 4] == 1 and whole.shape == (3, 3, 5)


def test_alone_jitted_and_in_a_batch_steps_agree():
    levels, _ = pool()
    env, params = envs.make(levels=levels)
    numbers = jnp.arange(16, dtype=jnp.int32)
    states = jax.jit(jax.vmap(env.reset_to, in_axes=(0, None)))(numbers, params)[1]
    keys = jax.random.split(jax.random.key(5), 16)
    batch = jax.jit(jax.vmap(env.step, in_axes=(0, 0, 0, None)))(keys, states, numbers, params)
    jitted = jax.jit(env.step)
    for i, step in ((0, env.step), (7, jitted), (13, jitted)):
        state = jax.tree.map(lambda array, i=i: array[i], states)
        one = step(keys[i], state, numbers[i], params)
        jax.tree.map(lambda a, b, i=i: np.testing.assert_array_equal(a, b[i]), one, batch)


@pytest.mark.parametrize("kind", ["walls", "fences", "rooms"])
def test_sampled_levels_are_solvable_and_their_oracle_is_right(kind):
    levels = envs.with_oracle(envs.sample_levels(jax.random.key(2), count=64, kind=kind))
    assert np.isfinite(levels.length).all() and (np.asarray(levels.removal) > 0).any()
    tasks = envs.to_tasks(levels)
    assert check(tasks, solve(tasks, max_destroyed=32)) == []
    one = unstack(jax.tree.map(lambda array: np.asarray(array)[:1], tasks))[0]
    opened = (
        ~np.isin(one.labels[0], np.flatnonzero(~one.destroyable))
        if levels.removal[0]
        else one.labels[0] == -1
    )
    assert dijkstra(opened, tuple(one.start))[tuple(one.goal)] <= levels.length[0] + 1e-4


def test_sampled_levels_are_the_same_inside_a_jit():
    outside = envs.sample_levels(jax.random.key(4), count=64, kind="walls")
    inside = jax.jit(lambda key: envs.sample_levels(key, count=64, kind="walls"))(jax.random.key(4))
    jax.tree.map(np.testing.assert_array_equal, outside, inside)


def test_levels_without_a_solution_are_left_out():
    tasks = [
        make_task(np.array([[1, free, 1]], bool), (0, 0), (0, 2), destroyable=False)
        for free in (True, False)
    ]
    levels = envs.make_levels(tasks)
    assert levels.start.shape == (1, 2) and levels.length.tolist() == [2]
    with pytest.raises(ValueError, match="none of the 1 tasks has a solution"):
        envs.make_levels(stack(tasks[1:]))


def test_the_oracle_of_mode_shortest_has_the_greatest_score():
    """Break or go round, on walls with a far gap: no plan of obstacles and route scores more."""
    tasks = []
    for gap in (2, 5, 8):
        labels = np.full((12, 12), -1)
        labels[: 12 - gap, 6] = 0
        tasks.append(make_task(labels, (0, 4), (0, 8), removal_cost=3.0))
    step_cost, weight = 0.25, 1.0
    levels = envs.make_levels(tasks, mode="shortest", toll=weight / step_cost)
    again = envs.with_oracle(levels, mode="shortest", toll=weight / step_cost)
    np.testing.assert_array_equal(again.length, levels.length)
    _, params = envs.make(levels=levels)
    params = params.replace(step_cost=step_cost, removal_weight=weight)
    scores = envs.relocation.oracle_score(params)
    for task, score, removal in zip(tasks, scores, levels.removal):
        broken = float(shortest_path(task.labels[0] <= 0, task.start, task.goal).cost)
        round_it = float(shortest_path(task.labels[0] < 0, task.start, task.goal).cost)
        best = max(10 - step_cost * broken - weight * 3, 10 - step_cost * round_it)
        assert float(score) == pytest.approx(best, rel=1e-6)
        assert float(removal) == (3 if best > 10 - step_cost * round_it else 0)
    assert {0.0, 3.0} == set(levels.removal.tolist())


def test_evaluate_plays_every_level_and_tells_the_regret():
    levels, _ = pool()
    env, params = envs.make(levels=levels)
    params = params.replace(max_steps_in_episode=30)
    result = envs.evaluate(
        env,
        params,
        lambda key, seen: jax.random.randint(key, (), 0, 16, jnp.int32),
        jax.random.key(0),
    )
    assert (
        result.score.shape == levels.length.shape
        and (result.regret > -0.1).all()
        and (result.regret > 5).any()
    )
    assert np.isnan(result.removal_regret[~result.success]).all() and "regret" in result.summary()


def test_a_picture_shows_obstacles_goal_and_agent():
    env, params, state = on("SA@\n..G", letters="A")
    picture = env.render(state, params)
    assert picture.shape == (32, 48, 3) and picture.dtype == np.uint8
    middles = picture[8::16, 8::16]
    assert len({tuple(colour) for colour in middles.reshape(-1, 3).tolist()}) == 5
    _, gone, *_ = env.step_env(jax.random.key(0), state, DESTROY + EAST, params)
    assert env.render(gone, params)[8, 24].tolist() == [255, 255, 255]


def test_wrong_options_are_named():
    with pytest.raises(ValueError, match="observation must be one of window, map"):
        envs.make(observation="radar")
    with pytest.raises(ValueError, match="SmartRelocation-v0"):
        envs.make("CartPole-v1")
    with pytest.raises(ValueError, match="size at least 12"):
        envs.sample_levels(jax.random.key(0), count=1, size=8)


def test_the_rules_read_no_more_than_the_cells_around():
    levels, _ = pool()
    env, params = envs.make(levels=levels)
    state = jax.eval_shape(env.reset_to, 0, params)[1]
    effect = jax.make_jaxpr(functools.partial(act, levels))(state, jnp.int32(0))
    largest = max(variable.aval.size for equation in effect.eqns for variable in equation.outvars)
    assert largest < 16 * 16, "an array of a map's size is made in a step"


def test_what_is_given_wrongly_is_named_with_the_remedy():
    levels, _ = pool()
    env, params = envs.make(levels=levels)
    key, state = jax.random.key(0), jax.jit(env.reset_to)(0, params)[1]
    with pytest.raises(TypeError, match=r"whole number 0\.\.15, got float32"):
        env.step(key, state, jnp.float32(1.5), params)
    with pytest.raises(ValueError, match=r"jax.vmap\(env.step"):
        env.step(key, state, jnp.zeros(3, jnp.int32), params)
    with pytest.raises(TypeError, match=r"envs\.make_levels"):
        envs.make(levels=envs.to_tasks(levels))
    with pytest.raises(TypeError, match="got ndarray"):
        envs.make_levels(np.ones((4, 4), bool))
    with pytest.raises(ValueError, match=r"\[task\] for one"):
        envs.make_levels(jax.tree.map(lambda array: array[0], envs.to_tasks(levels)))


def test_what_is_no_random_key_is_told_of_one():
    env, params = envs.make()
    smooth = perturbed(jnp.sum, num_samples=2, temperature=1.0)
    for call in (
        lambda key: envs.sample_levels(key, count=2, size=12),
        lambda key: env.reset(key, params),
        lambda key: envs.evaluate(env, params, lambda key, seen: 4, key),
        lambda key: smooth(key, jnp.ones(3)),
    ):
        with pytest.raises(TypeError, match=r"random key, such as jax\.random\.key\(0\), got"):
            call(0)
        with pytest.raises(ValueError, match=r"one JAX random key, got \[2\] of them: take"):
            call(jax.random.split(jax.random.key(0)))
    assert env.action_space().n == 16  # of gymnax where that is loaded, else our own
    assert repr(envs.spaces.Box(0, 1, (2,))) == "Box(0, 1, (2,), float32)"
