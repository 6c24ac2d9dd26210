"""Results on the host that become arrays of JAX: the same however often their form has come."""

import jax
import numpy as np

from srt_jax.engine import eager


def results(number):
    small = np.array([number, np.inf, -0.0], np.float32)
    large = np.full((1, 1 << 15), number, np.int32)
    return {"flag": np.array([True]), "large": large, "small": small[None]}


def test_small_results_of_a_common_form_are_what_rare_ones_are(monkeypatch):
    monkeypatch.setattr(eager, "_OFTEN", 2)
    eager._seen.clear()
    for number in range(5):
        given = results(number)
        out = eager.unfold(given, ())
        for name, array in given.items():
            assert isinstance(out[name], jax.Array) and not out[name].committed
            assert out[name].dtype == array.dtype
            np.testing.assert_array_equal(np.asarray(out[name]), array[0])
    assert set(eager._seen.values()) == {2}


def test_results_are_their_own(monkeypatch):
    monkeypatch.setattr(eager, "_OFTEN", 0)
    mine = np.arange(5, dtype=np.int32)[None]
    out = eager.unfold([mine], ())[0]
    mine[:] = -1
    assert out.tolist() == [0, 1, 2, 3, 4]


def test_without_jit_results_are_arrays_of_jax(monkeypatch):
    monkeypatch.setattr(eager, "_OFTEN", 0)
    with jax.disable_jit():
        assert isinstance(eager.unfold([np.zeros((1, 3), np.int32)], ())[0], jax.Array)
