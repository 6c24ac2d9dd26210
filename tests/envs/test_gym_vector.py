"""The environment of many in one call against Gymnasium's own vector of single ones; and both in
other processes.
"""

import functools
import os
import pickle
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax import envs

gymnasium = pytest.importorskip("gymnasium")


@pytest.fixture(autouse=True)
def lenient():
    """Gymnasium mixes dtypes and ranks of its own."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


@functools.cache
def rooms():
    levels = envs.sample_levels(jax.random.key(0), count=16, size=12)
    levels = levels.replace(removal=jnp.ones(16), length=jnp.full(16, 9.0))
    env, params = envs.make(levels=levels, radius=2)
    return env, params.replace(max_steps_in_episode=7)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_it_returns_what_a_vector_of_single_environments_returns(mode):
    from gymnasium.utils.env_checker import data_equivalence

    ours = envs.as_gymnasium_vector(*rooms(), num_envs=5, autoreset_mode=mode)
    theirs = gymnasium.vector.SyncVectorEnv(
        [functools.partial(envs.as_gymnasium, *rooms())] * 5, autoreset_mode=mode
    )
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"]
    rng, ended = np.random.default_rng(0), 0
    assert data_equivalence(ours.reset(seed=3), theirs.reset(seed=3), exact=True)
    for _ in range(24):
        actions = rng.integers(0, 16, 5)
        told, wanted = ours.step(actions), theirs.step(actions)
        for mine, other in zip(told, wanted, strict=True):
            assert data_equivalence(mine, other, exact=True)
        is_over = told[2] | told[3]
        ended += int(is_over.sum())
        if mode == "Disabled" and is_over.any():
            with pytest.raises(ValueError, match=r"environment \d is over: reset it first"):
                ours.step(actions)
            again = [side.reset(options={"reset_mask": is_over}) for side in (ours, theirs)]
            assert data_equivalence(*again, exact=True)
    assert ended >= 15


def test_seeds_levels_and_options_are_those_of_single_environments():
    env, params = rooms()
    many = gymnasium.make_vec(
        "srt_jax.envs.gym:SmartRelocation-v0", 4, env=env, params=params, max_episode_steps=2
    )
    assert many.spec.max_episode_steps == 2 and many.num_envs == 4
    seen, infos = many.reset(seed=[1, 1, 2, None])
    assert infos["level"][0] == infos["level"][1] and (seen[0] == seen[1]).all()
    assert many.reset(options={"level": [3, 1, 2, 0]})[1]["level"].tolist() == [3, 1, 2, 0]
    many.step(np.zeros(4, int))
    assert many.step(np.zeros(4, int))[3].all()
    first, second = (envs.as_gymnasium_vector(env, params, num_envs=8).reset()[1] for _ in range(2))
    assert (first["level"] != second["level"]).any()  # without a seed each takes its own
    single = envs.as_gymnasium(env, params, render_mode="rgb_array")
    assert gymnasium.make(single.spec).spec.max_episode_steps == 7


def test_gymnasiums_wrappers_take_it():
    env, params = rooms()
    many = gymnasium.wrappers.vector.RecordEpisodeStatistics(
        envs.as_gymnasium_vector(env, params, num_envs=3, render_mode="rgb_array")
    )
    many.reset(seed=0)
    for _ in range(7):
        *_, infos = many.step(np.full(3, 2))
    assert infos["episode"]["l"].tolist() == [7, 7, 7]
    assert [picture.shape for picture in many.render()] == [(192, 192, 3)] * 3


def test_what_is_given_wrongly_is_named():
    env, params = rooms()
    many = envs.as_gymnasium_vector(env, params, num_envs=3)
    with pytest.raises(ValueError, match="call reset first"):
        many.step(np.zeros(3, int))
    with pytest.raises(ValueError, match="leave reset_mask out"):
        many.reset(options={"reset_mask": np.array([True, False, True])})
    with pytest.raises(ValueError, match=r"level must be 0\.\.15"):
        many.reset(options={"level": 16})
    with pytest.raises(ValueError, match="seed must have 3 entries, got 2"):
        many.reset(seed=[1, 2])
    many.reset(seed=0)
    with pytest.raises(ValueError, match=r"whole numbers \[3\], got float64 \[3\]"):
        many.step(np.zeros(3))
    with pytest.raises(ValueError, match="got 16 for environment 2"):
        many.step(np.array([0, 15, 16]))
    with pytest.raises(ValueError, match="num_envs must be at least 1"):
        envs.as_gymnasium_vector(env, params, num_envs=0)


def test_environments_are_pickled_in_the_middle_of_an_episode():
    env, params = rooms()
    single = envs.as_gymnasium(env, params)
    single.reset(seed=3)
    many = envs.as_gymnasium_vector(env, params, num_envs=3)
    many.reset(seed=3)
    for one, action in ((single, 4), (many, np.array([4, 5, 6]))):
        one.step(action)
        twin = pickle.loads(pickle.dumps(one))
        for _ in range(4):
            np.testing.assert_equal(twin.step(action)[:4], one.step(action)[:4])
        np.testing.assert_equal(twin.reset(), one.reset())


@pytest.mark.parametrize("kind", ["window", "map"])
def test_observations_lie_within_finite_bounds(kind):
    levels = envs.sample_levels(jax.random.key(1), count=8, kind="walls", size=12)
    env, params = envs.make(levels=levels, observation=kind)
    many = envs.as_gymnasium_vector(env, params, num_envs=16)
    space = many.observation_space
    assert np.isfinite(space.low).all() and np.isfinite(space.high).all()
    rng = np.random.default_rng(0)
    assert many.reset(seed=0)[0] in space
    for _ in range(30):
        seen, *_ = many.step(rng.integers(0, 16, 16))
        assert seen in space


PROGRAM = """
import functools, sys, warnings
import numpy as np
from srt_jax import envs, make_task
from gymnasium.vector import AsyncVectorEnv

if __name__ == "__main__":
    warnings.simplefilter("ignore")
    free = np.ones((6, 7), bool)
    free[:, 3] = False
    levels = envs.make_levels([make_task(free, (0, 0), (5, 6))], oracle=False)
    env, params = envs.make(levels=levels)
    make = functools.partial(envs.as_gymnasium, env, params)
    many = AsyncVectorEnv([make] * 2, context=sys.argv[1])
    try:
        many.reset(seed=0)
        print(many.step(np.array([4, 6]))[0].shape)
        many.close()
    except RuntimeError as error:
        print(error)
        many.close(terminate=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("context", "says"),
    [("spawn", "(2, 9, 9, 6)"), ("fork", 'AsyncVectorEnv(..., context="spawn")')],
)
def test_other_processes_step_when_spawned_and_say_so_when_forked(context, says, tmp_path):
    if context == "fork" and not hasattr(os, "fork"):
        pytest.skip("no fork here")
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    paths = os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, str(program), context],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert says in done.stdout, done.stderr


def test_options_go_through_gymnasium_or_are_named():
    name, params = "srt_jax.envs.gym:SmartRelocation-v0", rooms()[1]
    one = gymnasium.make(name, observation="map", levels=params.levels)
    assert one.observation_space.shape == (12, 12, 5)
    many = gymnasium.make_vec(name, num_envs=2, radius=1, levels=params.levels)
    assert many.observation_space.shape == (2, 3, 3, 6)
    with pytest.raises(TypeError, match=r"no option 'size': it takes .*envs\.make"):
        envs.as_gymnasium(size=3)
    with pytest.raises(TypeError, match="radius was given beside env"):
        envs.as_gymnasium(*rooms(), radius=3)
