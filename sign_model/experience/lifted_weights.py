"""Weights learned from tasks with different objects: each task is searched on its own, on the host.

As in `experience.learn`, samples are drawn around a mean that moves towards the best. A few small
problems teach less than a batch of hundreds, so the search is short, and every predicate and
schema starts from the weight of the better unlearned sign.
"""

from collections.abc import Callable, Sequence

import numpy as np

from sign_model.experience import cross_entropy
from sign_model.map_algorithm.a_step import kind_of, make_rating
from sign_model.map_algorithm.heuristics import (
    COUNTS,
    LANDMARKS,
    RELAXED_PLAN,
    HeuristicSign,
    weight_of,
)
from sign_model.map_algorithm.map_planner import regress
from sign_model.map_algorithm.regression import regression_space
from sign_model.pddl.planning_task import PlanningTask

_MAX_WEIGHT = 255
_MOST_STEPS = 400
"""Steps of a search before it counts as without a plan."""


def learn_apart(
    tasks: Sequence[PlanningTask],
    *,
    name: str,
    generations: int,
    population: int,
    beam: int,
    seed: int,
    log: Callable[[str], None] | None,
) -> HeuristicSign:
    """Returns a sign whose weights give short plans on the tasks; on them never worse than the
    unlearned `LANDMARKS`. Arguments as in `learn`.
    """
    trial = _Trial(tasks, name, beam)
    unlearned = {sign.name: trial.weights(sign) for sign in (LANDMARKS, RELAXED_PLAN)}
    scores = {key: trial.score(weights) for key, weights in unlearned.items()}
    begin = min(scores, key=lambda key: scores[key])
    best, best_score = unlearned[begin], scores[begin]
    for one in cross_entropy.generations(
        lambda weights, _: trial.score(weights),
        best * cross_entropy.FIRST_SCALE,
        count=generations,
        population=population,
        seed=seed,
    ):
        if one.score < best_score:
            best, best_score = one.best, one.score
        if log is not None:
            log(f"generation {one.number + 1} of {generations}: best mean {one.score:.2f}")
    return trial.sign(best)


class _Trial:
    """Tasks on which weights are tried."""

    def __init__(self, tasks: Sequence[PlanningTask], name: str, beam: int) -> None:
        self.name, self.beam = name, beam
        self.parts = []
        for task in tasks:
            space = regression_space(task)
            ends = space.situations(task.start), space.situations(task.goal)
            schemas = [task.actions[a][0] for a in space.kept_actions]
            self.parts.append((space, *ends, schemas, {}))
        kinds = sorted({kind_of(atom) for task in tasks for atom in task.features})
        schemas = sorted({action[0] for task in tasks for action in task.actions})
        self.names = [
            (count, one) for count in COUNTS for one in (schemas if count == "plan" else kinds)
        ]
        self.goal_kinds = {
            kind_of(task.features[f]) for task in tasks for f in np.flatnonzero(task.goal)
        }

    def weights(self, sign: HeuristicSign) -> np.ndarray:
        """Returns the weights of a sign, float [names]."""
        return np.array(
            [weight_of(getattr(sign, count), one, self.goal_kinds) for count, one in self.names],
            float,
        )

    def sign(self, weights: np.ndarray) -> HeuristicSign:
        """Returns the sign with these weights, float [names], rounded."""
        whole = np.clip(np.round(weights), 0, _MAX_WEIGHT).astype(int)
        tables: dict[str, dict[str, int]] = {count: {} for count in COUNTS}
        for (count, one), weight in zip(self.names, whole.tolist()):
            if weight:
                tables[count][one] = weight
        return HeuristicSign(self.name, **tables)

    def score(self, weights: np.ndarray) -> float:
        """Returns the mean length of the plans; a task without one counts `_MOST_STEPS`."""
        sign, lengths = self.sign(weights), []
        for space, start, goal, schemas, tables in self.parts:
            rating = make_rating(sign, space, start, goal, schemas, tables=tables)
            found = regress(
                space,
                start,
                goal,
                rating,
                beam=self.beam,
                max_expansions=self.beam * _MOST_STEPS,
                patience=16,
            )
            lengths.append(_MOST_STEPS if found.plan is None else len(found.plan))
        return float(np.mean(lengths))
