"""Stable-Baselines3 finds nothing wrong with the environment, and learns on it."""

import warnings

import jax
import numpy as np
import pytest

from srt_jax import envs, make_task


@pytest.mark.slow
def test_its_checker_is_content_and_a_short_run_learns():
    pytest.importorskip("stable_baselines3")
    gymnasium = pytest.importorskip("gymnasium")
    from stable_baselines3 import PPO
    from stable_baselines3.common.env_checker import check_env

    free = np.ones((3, 5), bool)
    free[:, 2] = False
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        levels = envs.make_levels([make_task(free, (1, 1), (1, 3))])
        env, params = envs.make(levels=levels, radius=2)
        # it takes three dimensions for a picture: flat, as its policy for vectors wants it
        flat = gymnasium.wrappers.FlattenObservation(
            envs.as_gymnasium(env, params.replace(max_steps_in_episode=30))
        )
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_env(flat)
        model = PPO("MlpPolicy", flat, n_steps=256, batch_size=64, seed=0, device="cpu")
        model.learn(2048)
        lengths = [one["l"] for one in model.ep_info_buffer]
        rewards = [one["r"] for one in model.ep_info_buffer]
    third = len(rewards) // 3
    assert max(lengths) <= 30
    assert np.mean(rewards[-third:]) > np.mean(rewards[:third]) + 1
