"""Learns the weights of a heuristic sign from experience, by a cross-entropy search over whole
batches of tasks.

Weights are sampled around a mean, a batch of tasks is searched with each sample, and the mean moves
towards the best quarter of the samples. The weights are an argument of the jitted search, so it is
compiled only once. The result is a whole number for each predicate, so the sign also applies to
tasks of the same domain with more objects than those it was learned from.
"""

from collections.abc import Callable, Sequence

import numpy as np

from sign_model.experience import cross_entropy
from sign_model.experience.lifted_weights import learn_apart
from sign_model.experience.precedent import require_one_domain
from sign_model.foundation.sizes import next_power_of_two
from sign_model.map_algorithm.a_step import kind_of
from sign_model.map_algorithm.heuristics import LANDMARKS, HeuristicSign, weight_of
from sign_model.map_batch.grouping import share_matrices
from sign_model.map_batch.iteration import regress
from sign_model.map_batch.packed_tasks import pack_batch
from sign_model.map_batch.tables import MAX_WEIGHT
from sign_model.pddl.planning_task import PlanningTask

_COUNTS = ("landmarks", "held", "unmet")
_TOLERANCE = 1.002  # how much longer plans may become, as a factor, when a weight is set to 0


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
      tasks: of one domain. Those that share their features and actions (as from
        `random_blocks_tasks`) are searched as batches, and a few hundred small ones teach most; of
        tasks with different objects, each searched on its own, a few small ones must do.
      name: of the sign.
      generations, population: of the search. Each sample of each generation searches one batch.
      beam: situations kept in each step while learning; a narrow beam separates good weights from
        bad ones.
      lanes: tasks of one batch; the generations take the batches in turn.
      seed: of the random numbers.
      log: called with a line of text to report progress.

    Raises:
      ValueError: there are no tasks, or they are of several domains.

    Examples:
      >>> import sign_model
      >>> from sign_model.blocks import random_blocks_tasks
      >>> tasks = random_blocks_tasks(3, 4, seed=0)
      >>> sign_model.learn(tasks, generations=1, population=2, lanes=4).name
      'learned'
    """
    if not tasks:
        raise ValueError("learn needs at least one task")
    if not share_matrices(tasks):
        require_one_domain(tasks)
        search = {"generations": generations, "population": population, "beam": beam}
        return learn_apart(tasks, name=name, seed=seed, log=log, **search)
    trial = _Trial(tasks, name, beam, lanes)
    mean = trial.unlearned * cross_entropy.FIRST_SCALE
    for one in cross_entropy.generations(
        trial.mean_length, mean, count=generations, population=population, seed=seed
    ):
        mean = one.mean
        if log is not None and one.number % 5 == 4:
            log(f"generation {one.number + 1} of {generations}: best mean length {one.score:.2f}")

    # Simplify, and compare with the unlearned weights on all tasks.
    mean = _prune(trial, mean)
    learned, unlearned = (trial.mean_length_of_all(weights) for weights in (mean, trial.unlearned))
    if log is not None:
        log(
            f"mean length {learned:.2f} with the learned weights, {unlearned:.2f} with the"
            " unlearned ones"
        )
    return trial.sign(mean if learned <= unlearned else trial.unlearned)


def _prune(trial: "_Trial", weights: np.ndarray) -> np.ndarray:
    """Returns the weights, float [counts, kinds], with those set to 0 that hardly help, the
    smallest first: a count without weights needs no table.
    """
    kept = np.round(weights)
    bound = trial.mean_length_of_all(kept) * _TOLERANCE
    for place in sorted(np.ndindex(kept.shape), key=lambda place: kept[place]):
        without = kept.copy()
        without[place] = 0
        if kept[place] > 0 and trial.mean_length_of_all(without) <= bound:
            kept = without
    return kept


class _Trial:
    """Batches of tasks on which weights are tried.

    kinds: the predicates.
    unlearned: the weights of `LANDMARKS`, float [counts, kinds].
    steps: the longest plan.
    """

    def __init__(self, tasks: Sequence[PlanningTask], name: str, beam: int, lanes: int) -> None:
        self.name, self.beam = name, beam
        self.kinds = sorted({kind_of(atom) for atom in tasks[0].features})
        # Landmark columns for every predicate, whatever is sampled.
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

        # The batches: at most `lanes` tasks each, padded to a multiple of the batch slots.
        self.steps = 6 * int(len(self.batch.space.features) ** 0.5) + 8
        numbers = np.arange(len(tasks))
        self.num_slots = min(64, next_power_of_two(lanes))
        size = -(-lanes // self.num_slots) * self.num_slots
        self.parts = [
            self.batch.queue(numbers[i : i + lanes], size) for i in range(0, len(tasks), lanes)
        ]

    def sign(self, weights: np.ndarray) -> HeuristicSign:
        """Returns the sign with these weights, float [counts, kinds], rounded."""
        whole = np.clip(np.round(weights), 0, MAX_WEIGHT).astype(int)
        tables = [{kind: int(w) for kind, w in zip(self.kinds, row) if w} for row in whole]
        return HeuristicSign(self.name, **dict(zip(_COUNTS, tables)))

    def mean_length(self, weights: np.ndarray, part: int) -> float:
        """Returns the mean length of the plans of one batch, numbered cyclically; an unsolved task
        counts twice the longest plan.
        """
        start, goal, count = self.parts[part % len(self.parts)]
        packed = self.batch.weights_of(self.sign(weights))
        branch = min(64, int(len(self.batch.space.features) ** 0.5) + 2)
        options = {
            "beam": self.beam,
            "branch": branch,
            "steps": self.steps,
            "lanes": self.num_slots,
        }
        length = np.asarray(regress(self.batch.tables, packed, start, goal, count, **options)[0])[
            :count
        ]
        return float(np.where(length >= 0, length, 2 * self.steps).mean())

    def mean_length_of_all(self, weights: np.ndarray) -> float:
        """Returns the mean over all batches of `mean_length`."""
        return float(np.mean([self.mean_length(weights, part) for part in range(len(self.parts))]))
