"""What the crews of engines share: a cluster that is started anew, the environment."""

import os

import pytest

from srt_jax.scale.crews.crew import Cluster
from srt_jax.scale.crews.environment import in_environment
from tests.helpers.units import Lines


class Deserted(Cluster):
    """A cluster whose workers never answer."""

    def __init__(self, job):
        super().__init__(job)
        self.events = []

    def _connect(self):
        self.events.append("connect")

    def has_room(self):
        return True

    def submit(self, unit):
        self._units[f"task {unit} after {len(self.events)}"] = unit
        self.num_busy += 1

    def next(self):
        self._start_anew(2, "nobody answers")

    def close(self):
        self.events.append("close")
        self._units, self.num_busy = {}, 0


def test_a_cluster_started_anew_gets_all_its_units_again_and_is_given_up_at_last(tmp_path):
    deserted = Deserted(Lines(tmp_path, 4))
    deserted.submit(3)
    deserted.submit(1)
    for times in (1, 2):
        deserted.next()
        assert deserted.events == ["close", "connect"] * times
        assert list(deserted._units.values()) == [3, 1] and deserted.num_busy == 2
    with pytest.raises(RuntimeError, match="nobody answers"):
        deserted.next()


def test_what_is_set_for_the_workers_to_be_started_is_not_left(monkeypatch):
    monkeypatch.setenv("SRT_JAX_CORES", "3")
    monkeypatch.delenv("SRT_JAX_NEW", raising=False)
    with in_environment({"SRT_JAX_CORES": "1", "SRT_JAX_NEW": "2"}):
        assert (os.environ["SRT_JAX_CORES"], os.environ["SRT_JAX_NEW"]) == ("1", "2")
    assert os.environ["SRT_JAX_CORES"] == "3" and "SRT_JAX_NEW" not in os.environ
