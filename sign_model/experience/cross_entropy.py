"""The cross-entropy search for weights: samples round a mean, which moves towards the best."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

FIRST_SCALE = 4.0
"""The first mean over the unlearned weights."""

_FIRST_SPREAD, _LEAST_SPREAD = 3.0, 0.2


class Generation(NamedTuple):
    """number: from 0. best: the sample with the least score, float like the weights. score: its
    score. mean: of the next samples.
    """

    number: int
    best: np.ndarray
    score: float
    mean: np.ndarray


def generations(
    score: Callable[[np.ndarray, int], float],
    mean: np.ndarray,
    *,
    count: int,
    population: int,
    seed: int,
) -> Iterator[Generation]:
    """Yields `count` generations of the search for weights of a small score.

    Args:
      score: (weights, number of the generation) -> what is to be small.
      mean: float, the first mean.
      population: samples of a generation; the mean itself is among them.
    """
    rng = np.random.default_rng(seed)
    spread = np.full(mean.shape, _FIRST_SPREAD)
    num_best = max(2, population // 4)
    for number in range(count):
        samples = mean + spread * rng.normal(size=(population, *mean.shape))
        samples[0] = mean
        scores = np.array([score(weights, number) for weights in samples])
        order = np.argsort(scores, kind="stable")
        best = samples[order[:num_best]]
        mean = (mean + best.mean(axis=0)) / 2
        spread = (spread + best.std(axis=0) + _LEAST_SPREAD) / 2
        yield Generation(number, samples[order[0]], float(scores[order[0]]), mean)
