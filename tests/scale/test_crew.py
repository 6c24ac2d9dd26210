"""What the crews of engines share: a cluster that is started anew."""

import pytest

from srt_jax.scale.crews.crew import Cluster
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
    crew = Deserted(Lines(tmp_path, 4))
    crew.submit(3)
    crew.submit(1)
    for times in (1, 2):
        crew.next()
        assert crew.events == ["close", "connect"] * times
        assert list(crew._units.values()) == [3, 1] and crew.num_busy == 2
    with pytest.raises(RuntimeError, match="nobody answers"):
        crew.next()
