"""How much every plan of a task costs at least, by what must be done and what must be done twice:
a plan of that cost is proven cheapest.

The landmarks of the goal tell what must be brought about at some time. Take one, a, that is used up
by a goal g: every script that brings g about needs a and takes it away, as holding a block is used
up by putting it down. From the last time that a holds, a or g holds to the end. Hence

    last(r) < last(a)     for every landmark r that can hold neither beside a nor beside g
    first(r) < last(a)    for every landmark r that can't hold beside a, and is needed before g
                          holds for the first time
    first(c) <= first(r)  for every landmark c of r

If a is brought about only once, it holds without a break, so what can't hold beside it and comes
before its last time comes before its first. Where these orders make a circle through some features,
not all of them can be brought about only once. (Gupta & Nau 1992 found such circles in
blocks, and called them deadlocks; Buechner, Keller & Helmert 2021 use circles of landmarks.)

Features of which no two hold together are brought about one at a time, and each must be taken away
before it is brought about again. Where no script does both at once, these costs add up.
"""

from collections.abc import Iterable, Iterator

import numpy as np

from sign_model.bits import all_rows, any_row, unpack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.landmarks import landmark_table
from sign_model.map_algorithm.regression import RegressionSpace

_MOST_TRIED = 2000
"""How many sets are looked at to find the fewest features that break all circles."""

_MOST_ENDS = 64
"""For so many features it is tried which of them is left at the end."""


def least_cost(
    space: RegressionSpace,
    start: np.ndarray,
    goal: np.ndarray,
    costs: np.ndarray,
    clock: Clock = NO_LIMIT,
) -> int:
    """Returns a bound that no plan can fall below, 0 where nothing is known.

    Args:
      space: the features and actions; its mutexes hold in all situations reachable from the start.
      start, goal: bool [F], over the features of the space.
      costs: of its actions, whole numbers [A]; all 1 to bound the length.
      clock: asked in every phase; OutOfTime once its limit has passed.
    """
    if not (goal & ~start).any() or not len(space.conditions):
        return 0
    size = len(start)
    table = landmark_table(space, start, clock)
    needs = unpack(table, size)
    must = needs[goal].any(axis=0) & ~start

    # The orders: whose last time is before whose, and whose first time.
    lasts, firsts = np.zeros((size, size), bool), np.zeros((size, size), bool)
    for a, g in _used_up(space, start, goal, must):
        clock.check()
        apart = must & space.mutex[a]
        lasts[a] |= apart & space.mutex[g]
        firsts[a] |= apart & _needed_before(space, table, start, g)

    # What each of them comes after if it is brought about only once.
    after = np.zeros((size, size), bool)
    for a in np.flatnonzero(firsts.any(axis=1) | lasts.any(axis=1)):
        clock.check()
        before = lasts[a]
        while True:  # ends: the set only grows
            larger = before | lasts[before].any(axis=0)
            if (larger == before).all():
                break
            before = larger
        earlier = before | firsts[a] | firsts[before].any(axis=0)
        after[a] = needs[earlier].any(axis=0)
    return max(
        (
            _cost_of_family(space, goal, costs, family, after, clock)
            for family in _families(space, must)
        ),
        default=0,
    )


def _used_up(
    space: RegressionSpace, start: np.ndarray, goal: np.ndarray, must: np.ndarray
) -> Iterator[tuple[int, int]]:
    """Yields (a, g): features that must be brought about, and goals that use them up and have to be
    brought about after them.
    """
    for g in np.flatnonzero(goal).tolist():
        achievers = space.adds[:, g]
        if achievers.any():
            used = (space.conditions & space.deletes)[achievers].all(axis=0) & must
            for a in np.flatnonzero(used).tolist():
                if not start[g] or space.mutex[a, g]:
                    yield a, g


def _needed_before(
    space: RegressionSpace, table: np.ndarray, start: np.ndarray, feature: int
) -> np.ndarray:
    """Returns bool [F]: what must have held before a feature holds for the first time; nothing if
    it holds at the start.
    """
    if start[feature]:
        return np.zeros(len(start), bool)
    achievers = np.flatnonzero(space.adds[:, feature])
    owner, member = np.nonzero(space.conditions[achievers])
    need = any_row(table, owner, member, len(achievers))
    every = np.arange(len(achievers))
    return unpack(all_rows(need, np.zeros_like(every), every, 1)[0], len(start))


def _families(space: RegressionSpace, must: np.ndarray) -> Iterator[np.ndarray]:
    """Yields sets, int [n], of features that must be brought about, of which no two hold
    together: all such features are in one of a single predicate, and in one of any predicates.
    """
    kinds = np.array(_numbered(atom[0] for atom in space.features))
    for is_mixed in (False, True):
        left = must.copy()
        while left.any():
            first = int(left.argmax())
            family = np.zeros_like(must)
            allowed = must & (is_mixed | (kinds == kinds[first]))
            others = np.flatnonzero(allowed)
            order = np.lexsort((others, ~left[others], kinds[others] != kinds[first]))
            for feature in [first, *others[order].tolist()]:
                if allowed[feature]:
                    family[feature] = True
                    allowed &= space.mutex[feature]
            left &= ~family
            yield np.flatnonzero(family)


def _numbered(names: Iterable[str]) -> list[int]:
    """Returns a number for each name, the same for the same name."""
    number: dict[str, int] = {}
    return [number.setdefault(name, len(number)) for name in names]


def _cost_of_family(
    space: RegressionSpace,
    goal: np.ndarray,
    costs: np.ndarray,
    family: np.ndarray,
    after: np.ndarray,
    clock: Clock,
) -> int:
    """Returns what it costs at least to bring about all features of one family, and to take them
    away again.
    """
    # What bringing about, and taking away, a feature costs at least.
    gives = space.adds[:, family]
    takes = (space.deletes & space.conditions)[:, family]
    unsure = (space.deletes & ~space.conditions)[:, family]
    dear = np.int64(1) << 60
    price = np.where(gives, costs[:, None], dear).min(axis=0)
    moves = bool((gives.any(axis=1) & (takes | unsure).any(axis=1)).any())
    back = np.where(takes | unsure, costs[:, None], dear).min(axis=0)
    back[back == dear] = 0
    if moves:
        back[:] = 0

    # One of them may be left at the end, unless the goal excludes it. If that is brought about only
    # once, then after all others.
    each = (price + back).tolist()
    inner = after[np.ix_(family, family)]
    ends = [int(_least_breaking(inner, each))]
    stays = np.flatnonzero(~space.mutex[np.ix_(family, np.flatnonzero(goal))].any(axis=1))
    if len(stays) > _MOST_ENDS:
        ends.append(ends[0] - int(back[stays].max()))
    else:
        for last in stays[back[stays] > 0]:
            clock.check()
            waits = inner.copy()
            waits[last] |= np.arange(len(family)) != last
            ends.append(_least_breaking(waits, each) - int(back[last]))
    return sum(each) + min(ends)


def _least_breaking(after: np.ndarray, costs: list[int]) -> int:
    """Returns the least that features cost which together break all circles; where too many sets
    would have to be looked at, a bound that is not above it.

    Args:
      after: bool [n, n], which features come after which.
      costs: of the features.
    """
    links = {i: set(np.flatnonzero(row).tolist()) for i, row in enumerate(after)}
    tried = 0

    def least(links: dict[int, set[int]], most: int) -> int:
        # the least cost that breaks all circles, or `most` if that is not less
        nonlocal tried
        links, forced = _on_circles(links), 0
        while alone := [i for i in sorted(links) if i in links[i]]:
            forced += sum(costs[i] for i in alone)
            links = _on_circles(_without(links, set(alone)))
        circles = _disjoint_circles(links)
        at_least = forced + sum(min(costs[i] for i in circle) for circle in circles)
        tried += 1
        if not circles or at_least >= most or tried > _MOST_TRIED:
            return min(most, at_least)
        for feature in min(circles, key=len):
            spent = forced + costs[feature]
            most = min(most, spent + least(_without(links, {feature}), most - spent))
        return most

    return least(links, sum(costs) + 1)


def _without(links: dict[int, set[int]], gone: set[int]) -> dict[int, set[int]]:
    return {i: to - gone for i, to in links.items() if i not in gone}


def _disjoint_circles(links: dict[int, set[int]]) -> list[list[int]]:
    """Returns circles that share no feature, short ones first."""
    circles = []
    while links:
        circles.append(_shortest_circle(links))
        links = _on_circles(_without(links, set(circles[-1])))
    return circles


def _on_circles(links: dict[int, set[int]]) -> dict[int, set[int]]:
    """Returns the links without the features that no circle can go through."""
    while True:
        kept = {i for i, to in links.items() if to & links.keys()}
        kept &= set().union(*links.values()) if links else set()
        if len(kept) == len(links):
            return links
        links = {i: links[i] & kept for i in kept}


def _shortest_circle(links: dict[int, set[int]]) -> list[int]:
    """Returns the features of a shortest circle."""
    best: list[int] = []
    for start in sorted(links):
        before, layer = {start: -1}, [start]
        end = -1
        while layer and end < 0:
            following = []
            for i in layer:
                if start in links[i]:
                    end = i
                    break
                for j in sorted(links[i]):
                    if j in links and j not in before:
                        before[j] = i
                        following.append(j)
            layer = following
        if end >= 0:
            circle = [end]
            while circle[-1] != start:
                circle.append(before[circle[-1]])
            if not best or len(circle) < len(best):
                best = circle
    return best
