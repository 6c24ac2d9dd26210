"""The example on flax and optax in small: it trains, and what it learns shows."""

import importlib.util
import pathlib

import jax
import numpy as np
import pytest

from srt_jax import envs, make_task

FILE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "examples" / "ppo_flax.py"


@pytest.fixture(autouse=True)
def lenient():
    """The example is written for a user's session, which has JAX's own defaults."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


@pytest.mark.slow
def test_it_learns_to_open_a_wall():
    pytest.importorskip("flax")
    pytest.importorskip("optax")
    spec = importlib.util.spec_from_file_location("ppo_flax", FILE)
    assert spec and spec.loader
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    example.NUM_ENVS, example.HORIZON = 32, 32
    free = np.ones((3, 5), bool)
    free[:, 2] = False
    levels = envs.make_levels([make_task(free, (1, 1), (1, 3))])
    env, params = envs.make(levels=levels, radius=2)
    weights, rewards = example.train(
        params.replace(max_steps_in_episode=30), env, updates=40, seed=0
    )
    assert rewards.shape == (40,) and np.isfinite(rewards).all()
    assert rewards[-5:].mean() > rewards[:5].mean() + 0.5
    logs, value = example.ActorCritic().apply(weights, np.zeros((3, 5, 5, 6), np.float32))
    assert logs.shape == (3, 16) and value.shape == (3,)
