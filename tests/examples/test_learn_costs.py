"""The example that learns traversal costs, run in small."""

import importlib

import numpy as np
import pytest

learn_costs = importlib.import_module("docs.examples.learn_costs")


@pytest.mark.slow
def test_costs_learned_from_shown_paths_find_better_ways_on_unseen_maps(tmp_path, capsys):
    assert (
        learn_costs.main(
            ["--out", str(tmp_path / "out"), "--maps", "32", "--side", "16", "--steps", "40"]
        )
        == 0
    )
    lines = capsys.readouterr().out.splitlines()
    before, after = (
        float(word.rstrip("%"))
        for word in next(line for line in lines if "before" in line).split()
        if "%" in word
    )
    assert 0 <= after < before / 2
    parameters = dict(np.load(tmp_path / "out" / "parameters.npz"))
    assert all(np.isfinite(value).all() for value in parameters.values()) and "first" in parameters
    assert (tmp_path / "out" / "learned_costs.png").stat().st_size > 10_000


def test_paths_shown_cost_the_least_and_at_other_costs_not_less():
    maps = learn_costs.make_maps(np.random.default_rng(3), 4, 16)
    np.testing.assert_allclose(
        (maps["shown"] * maps["costs"]).sum(axis=(1, 2)), maps["least"], rtol=1e-5
    )
    dearer = (maps["shown"] * maps["costs"][:, ::-1, ::-1]).sum(axis=(1, 2))
    least = learn_costs.srt_jax.path_cost(
        maps["free"], maps["start"], maps["goal"], maps["costs"][:, ::-1, ::-1].copy()
    )
    assert (dearer >= np.asarray(least) * (1 - 1e-5)).all() and (
        dearer > np.asarray(least) * 1.05
    ).any()
