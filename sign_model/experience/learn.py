"""Learns the weights of a heuristic sign from solved-and-unsolved experience: a cross-entropy
search over whole batches.

Weights are drawn around a mean, a batch of tasks is searched with each, and the mean moves towards
the best quarter. The weights are an argument of the jitted search, so that all of it compiles once.
What is learned are whole numbers per predicate: they serve tasks of the same domain with more
objects than those learned on.
"""

from collections.abc import Callable, Sequence

import numpy as np

from sign_model.map_algorithm.heuristics import LANDMARKS, HeuristicSign, weight_of
from sign_model.map_algorithm.rating import kind_of
from sign_model.map_batch.iteration import regress
from sign_model.map_batch.packed_tasks import pack_batch
from sign_model.map_batch.tables import MAX_WEIGHT
from sign_model.pddl.planning_task import PlanningTask

_COUNTS = ("landmarks", "held", "unmet")
_FIRST_SCALE, _FIRST_SPREAD, _LEAST_SPREAD = 4.0, 3.0, 0.2
_HARDLY = 1.002  # how much longer plans may get for a weight less


def learn(
    tasks: Sequence[PlanningTask],
    *,
    name: str = "learned",
    generations: int = 30,
    population: int = 24,
    beam: int = 4,
    lanes: int = 256,
    seed: int = 0,
    log: Callable[[str], None] | None = None,
) -> HeuristicSign:
    """Returns a sign whose weights give short plans on the tasks; it is never worse on them than
    the unlearned `LANDMARKS`.

    Args:
      tasks: of one domain, sharing their features and actions (as from `random_blocks_tasks`); a
        few hundred small ones.
      name: of the sign.
      generations, population: of the search; one batch of `lanes` tasks for each of their product.
      beam: situations kept a step while learning; narrow ones tell good weights from bad.
      lanes: tasks tried a generation, in turn.
      seed: of all random draws.
      log: told of progress.

    Raises:
      ValueError: no tasks, or tasks that don't share their features and actions.

    Examples:
      >>> import sign_model
      >>> from sign_model.blocks import random_blocks_tasks
      >>> tasks = random_blocks_tasks(3, 4, seed=0)
      >>> sign_model.learn(tasks, generations=1, population=2, lanes=4).name
      'learned'
    """
    trial = _Trial(tasks, name, beam, lanes)
    rng = np.random.default_rng(seed)
    mean, spread = trial.unlearned * _FIRST_SCALE, np.full(trial.unlearned.shape, _FIRST_SPREAD)
    best = max(2, population // 4)
    for generation in range(generations):
        drawn = mean + spread * rng.normal(size=(population, *mean.shape))
        drawn[0] = mean
        scores = np.array([trial.mean_length(weights, generation) for weights in drawn])
        chosen = drawn[np.argsort(scores, kind="stable")[:best]]
        mean = (mean + chosen.mean(axis=0)) / 2
        spread = (spread + chosen.std(axis=0) + _LEAST_SPREAD) / 2
        if log is not None and generation % 5 == 4:
            log(
                f"generation {generation + 1} of {generations}: best mean length {scores.min():.2f}"
            )
    mean = _pruned(trial, mean)
    learned, unlearned = (trial.mean_length_of_all(weights) for weights in (mean, trial.unlearned))
    if log is not None:
        log(
            f"mean length {learned:.2f} with the learned weights, {unlearned:.2f} with the"
            " unlearned ones"
        )
    return trial.sign(mean if learned <= unlearned else trial.unlearned)


def _pruned(trial: "_Trial", weights: np.ndarray) -> np.ndarray:
    """The weights less those that hardly help, the smallest first: what counts nothing needs no
    table.
    """
    kept = np.round(weights)
    bound = trial.mean_length_of_all(kept) * _HARDLY
    for place in sorted(np.ndindex(kept.shape), key=lambda place: kept[place]):
        without = kept.copy()
        without[place] = 0
        if kept[place] > 0 and trial.mean_length_of_all(without) <= bound:
            kept = without
    return kept


class _Trial:
    """Batches of tasks on which weights are tried."""

    def __init__(self, tasks: Sequence[PlanningTask], name: str, beam: int, lanes: int) -> None:
        if not tasks:
            raise ValueError("learn needs at least one task")
        self.name, self.beam = name, beam
        self.kinds = sorted({kind_of(atom) for atom in tasks[0].features})
        everything = HeuristicSign("everything", landmarks={"*": 1})
        self.batch = pack_batch(tasks, (everything,))
        goals = {
            kind_of(tasks[0].features[f]) for f in np.flatnonzero(self.batch.goals.any(axis=0))
        }
        self.unlearned = np.array(
            [
                [weight_of(getattr(LANDMARKS, c), kind, goals) for kind in self.kinds]
                for c in _COUNTS
            ],
            float,
        )
        self.steps = 6 * int(len(self.batch.space.features) ** 0.5) + 8
        numbers = np.arange(len(tasks))
        self.side_by_side = min(64, 1 << (lanes - 1).bit_length())
        size = -(-lanes // self.side_by_side) * self.side_by_side
        self.parts = [
            self.batch.queue(numbers[i : i + lanes], size) for i in range(0, len(tasks), lanes)
        ]

    def sign(self, weights: np.ndarray) -> HeuristicSign:
        whole = np.clip(np.round(weights), 0, MAX_WEIGHT).astype(int)
        tables = [{kind: int(w) for kind, w in zip(self.kinds, row) if w} for row in whole]
        return HeuristicSign(self.name, **dict(zip(_COUNTS, tables)))

    def mean_length(self, weights: np.ndarray, part: int) -> float:
        """The mean length of the plans; a task left unsolved counts twice the longest plan."""
        start, goal, count = self.parts[part % len(self.parts)]
        packed = self.batch.weights_of(self.sign(weights))
        branch = min(64, int(len(self.batch.space.features) ** 0.5) + 2)
        options = {
            "beam": self.beam,
            "branch": branch,
            "steps": self.steps,
            "lanes": self.side_by_side,
        }
        length = np.asarray(regress(self.batch.tables, packed, start, goal, count, **options)[0])[
            :count
        ]
        return float(np.where(length >= 0, length, 2 * self.steps).mean())

    def mean_length_of_all(self, weights: np.ndarray) -> float:
        return float(np.mean([self.mean_length(weights, part) for part in range(len(self.parts))]))
