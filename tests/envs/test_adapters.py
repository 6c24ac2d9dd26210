"""The faces of gymnax, Gymnasium and jumanji, judged by those libraries' own checks where they are
installed.
"""

import sys
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax import envs, make_task


@pytest.fixture(autouse=True)
def lenient():
    """The libraries mix dtypes and ranks of their own."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def small():
    free = np.ones((6, 7), bool)
    free[:, 3] = False
    tasks = [make_task(free, (0, 0), (5, 6)), make_task(free, (1, 1), (3, 5))]
    # what it would say is plain; asking it compiles for seconds
    levels = envs.make_levels(tasks, oracle=False)
    return envs.make(
        levels=levels.replace(
            removal=jnp.ones(2), length=jnp.array([1 + 5 * 2**0.5, 2 + 2 * 2**0.5])
        )
    )


def test_gymnasium_finds_nothing_wrong():
    gymnasium = pytest.importorskip("gymnasium")
    from gymnasium.utils.env_checker import check_env

    env, params = small()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(envs.as_gymnasium(env, params, render_mode="rgb_array"))
        made = gymnasium.make("srt_jax.envs.gym:SmartRelocation-v0", env=env, params=params)
        _, details = made.reset(seed=1, options={"level": 1})
    assert details == {"level": 1}
    with pytest.raises(ValueError, match=r"whole number 0..15, got 20"):
        made.unwrapped.step(20)
    *_, truncated, info = made.step(4)
    assert not truncated and info["length"] == 1 and isinstance(info["regret"], float)


@pytest.mark.slow
def test_jumanji_finds_nothing_wrong():
    pytest.importorskip("jumanji")
    from jumanji.testing.env_not_smoke import (
        check_env_does_not_smoke,
        check_env_specs_does_not_smoke,
    )
    from jumanji.wrappers import VmapAutoResetWrapper

    env, params = small()
    ours = envs.as_jumanji(env, params.replace(max_steps_in_episode=40))
    check_env_does_not_smoke(ours)
    check_env_specs_does_not_smoke(ours)
    batched = VmapAutoResetWrapper(ours)
    states, _ = batched.reset(jax.random.split(jax.random.key(0), 3))
    states, steps = jax.jit(batched.step)(states, jnp.array([4, 6, 7], jnp.int32))
    assert (
        steps.observation.planes.shape == (3, 9, 9, 6)
        and ours.render(jax.tree.map(lambda a: a[0], states)).ndim == 3
    )


@pytest.mark.slow
def test_gymnax_rolls_it_out_and_wraps_it():
    pytest.importorskip("gymnax")
    from gymnax.environments import spaces
    from gymnax.experimental import RolloutWrapper
    from gymnax.wrappers import GymnaxToGymWrapper, LogWrapper

    env, params = small()
    params = params.replace(max_steps_in_episode=9)
    assert isinstance(env.action_space(params), spaces.Discrete)
    for seed in range(3):  # gymnax's own pattern: every state and observation lies in its space
        key = jax.random.key(seed)
        seen, state = env.reset(key, params)
        for _ in range(12):
            key, used = jax.random.split(key)
            assert env.state_space(params).contains(state) and env.observation_space(
                params
            ).contains(seen)
            seen, state, *_ = env.step(used, state, env.action_space(params).sample(used), params)
    *_, reward, _, done, total = RolloutWrapper(env=env, env_params=params).batch_rollout(
        jax.random.split(jax.random.key(0), 4), None
    )
    assert reward.shape == done.shape == (4, 9) and done[:, -1].all() and total.shape == (4, 1)
    logged = LogWrapper(env)
    _, state = logged.reset(jax.random.key(0), params)
    assert (
        logged.step(jax.random.key(1), state, jnp.int32(0), params)[-1]["returned_episode_returns"]
        == 0
    )
    assert GymnaxToGymWrapper(env, params).reset(seed=0)[0].shape == (9, 9, 6)


def test_gymnax_registers_it():
    gymnax = pytest.importorskip("gymnax")
    if envs.ID not in gymnax.registered_envs:
        gymnax.register(envs.ID, envs.SmartRelocation)
    env, _ = gymnax.make(envs.ID, radius=2)
    assert env.radius == 2 and env.name == envs.ID and env.num_actions == 16


@pytest.mark.parametrize("name", ["gymnasium", "jumanji"])
def test_a_missing_library_is_named_with_the_command_that_installs_it(name, monkeypatch):
    for loaded in [module for module in sys.modules if module.split(".")[0] == name]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.setitem(sys.modules, name, None)
    module = "gym" if name == "gymnasium" else name
    monkeypatch.delitem(sys.modules, f"srt_jax.envs.{module}", raising=False)
    with pytest.raises(ImportError, match=rf"pip install '?{name}"):
        getattr(envs, f"as_{name}")(*small())
