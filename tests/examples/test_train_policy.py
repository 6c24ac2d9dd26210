"""The worked example in small: it trains, beats chance on held-out levels, saves and loads."""

import importlib.util
import pathlib

import jax
import numpy as np
import pytest

FILE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "examples" / "train_policy.py"


@pytest.fixture(autouse=True)
def lenient():
    """The example is written for a user's session, which has JAX's own defaults."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


@pytest.mark.slow  # test_ppo_flax stays: another example that trains
def test_training_in_small_beats_chance_and_the_parameters_come_back(tmp_path):
    spec = importlib.util.spec_from_file_location("train_policy", FILE)
    assert spec and spec.loader
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    weights, results = example.train(
        kind="rooms", num_levels=64, num_held_out=64, imitation=300, updates=2
    )
    assert results["trained"].regret.mean() < results["random"].regret.mean() - 3
    assert results["trained"].success.mean() > results["random"].success.mean() + 0.2
    example.save(tmp_path / "policy.npz", weights)
    jax.tree.map(np.testing.assert_array_equal, weights, example.load(tmp_path / "policy.npz"))
