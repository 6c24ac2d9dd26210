"""The least removal by integer programming: an exact solver that shares no idea with
`srt_jax.removal.branch_and_bound`.

Binary x_o: obstacle o is destroyed; y_S <= x_o for every owner o of S: cells owned by exactly the
obstacles S are open. Cuts are added as needed: flood from the start with what the last optimum
destroys; if the goal is not reached, some cell on the border of the flood has to be open in any
solution, as whoever leaves the flood does so over one of them.
"""

import numpy as np
from scipy import ndimage, optimize

from srt_jax import Task


def exact_removal(task: Task) -> float:
    """Returns the least total removal cost of `task`; 0 where a path exists, inf where there is no
    solution.
    """
    layers, costs = np.asarray(task.labels), np.asarray(task.removal_cost, np.float64)
    start, goal = (tuple(np.asarray(end).tolist()) for end in (task.start, task.goal))
    columns, place = np.unique(layers.reshape(len(layers), -1), axis=1, return_inverse=True)
    place = place.reshape(layers.shape[1:])
    owners = [frozenset(column) - {-1} for column in columns.T.tolist()]
    can_open = np.array([all(o >= 0 and task.destroyable[o] for o in group) for group in owners])
    if owners[place[start]] or not can_open[place[goal]]:
        return float("inf")
    num, cuts = len(costs), []
    objective = np.concatenate([costs, np.zeros(len(owners))])
    links = [(num + s, o) for s, group in enumerate(owners) if can_open[s] for o in group]
    needs = np.zeros((len(links), len(objective)))
    needs[np.arange(len(links)), [y for y, _ in links]] = 1
    needs[np.arange(len(links)), [o for _, o in links]] = -1
    most = np.concatenate([task.destroyable, can_open]).astype(float)
    gone: set[int] = set()
    while True:
        is_open = np.array([group <= gone for group in owners])[place]
        regions = np.asarray(ndimage.label(is_open)[0])  # type: ignore[index]
        if regions[start] == regions[goal]:
            return float(costs[sorted(gone)].sum())
        flood = regions == regions[start]
        border = np.unique(place[ndimage.binary_dilation(flood) & ~is_open])
        border = border[can_open[border]]
        if not len(border):
            return float("inf")
        cuts.append(np.isin(np.arange(len(objective)), num + border).astype(float))
        rows = [optimize.LinearConstraint(np.array(cuts), 1, np.inf)]
        rows += [optimize.LinearConstraint(needs, -np.inf, 0)] if links else []
        found = optimize.milp(
            objective, constraints=rows, integrality=1, bounds=optimize.Bounds(0, most)
        )  # type: ignore[arg-type]
        if found.x is None:
            return float("inf")
        gone = set(np.flatnonzero(found.x[:num] > 0.5).tolist())
