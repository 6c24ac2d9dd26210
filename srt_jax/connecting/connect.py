"""The least removal that joins given regions, or all of them."""

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from srt_jax.components import regions
from srt_jax.connecting.graph import Graph, graph_of, is_open
from srt_jax.connecting.least_set import search
from srt_jax.engine import arguments
from srt_jax.engine.entrance import require_single
from srt_jax.types import OUTSIDE, Array, Task


class Connection(NamedTuple):
    """What joins regions (`srt_jax.connect`).

    Attributes:
      destroyed: ids of the obstacles to destroy, ascending.
      removal_cost: of these; inf where no removal joins the regions.
      removal_bound: proven: no removal that joins them costs less. Equal to `removal_cost` where
        the answer is proven.
      joined: bool [H, W], the region that then holds them all; all False where there is none.
    """

    destroyed: tuple[int, ...]
    removal_cost: float
    removal_bound: float
    joined: np.ndarray

    def __repr__(self) -> str:
        """What it says in a line; `joined` holds the cells."""
        proven = self.removal_cost == self.removal_bound
        sure = "proven least" if proven else f"at least {self.removal_bound:g}"
        return (
            f"Connection(destroyed {list(self.destroyed)}, removal cost {self.removal_cost:g},"
            f" {sure}, {int(self.joined.sum())} cells joined)"
        )


def connect(
    task: Task,
    cells: Array | Sequence[Sequence[int]] | None = None,
    *,
    min_cells: int = 1,
    max_branches: int = 256,
) -> Connection:
    """Returns the least removal after which the agent can walk between all `cells`, or between all
    regions of the map.

    A level or a town with parts that cannot be reached: which walls to open so that all is one?
    Exact for up to 8 regions where each obstacle is joined by sides and no two overlap: a least
    tree. Else branch and bound; for more than 8 regions, from cuts: then perhaps not the least, but
    `removal_bound` holds always. Costs are added and compared exactly; only what is returned is
    rounded, down to float32. Of the task only labels, flags and costs count. On the host: for
    tasks, not for jit.

    Args:
      task: a single task.
      cells: integer [k, 2], (row, col), one of each region to be joined; what covers one has to go.
        None for all regions of free cells.
      min_cells: without `cells`: regions of fewer cells are left as they are.
      max_branches: choices of obstacles looked into before the best answer so far is returned.

    Raises:
      TypeError, ValueError: a batch instead of one task; a cell outside the map; an array of a
        wrong dtype or shape; min_cells or max_branches below 1.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> labels = np.full((5, 9), -1)
      >>> labels[:, 2], labels[:, 6], labels[2, 3:6] = 0, 1, 2  # four rooms, three walls
      >>> task = srt_jax.make_task(labels, (0, 0), (0, 8), removal_cost=[1.0, 1.0, 5.0])
      >>> srt_jax.connect(task, [(0, 0), (0, 4), (4, 8)]).destroyed
      (0, 1)
      >>> everything = srt_jax.connect(task)
      >>> everything.destroyed, everything.removal_cost  # walls 0 and 1 join all four
      ((0, 1), 2.0)
    """
    require_single("connect", task)
    for name, value in (("min_cells", min_cells), ("max_branches", max_branches)):
        if value < 1:
            raise ValueError(f"{name} must be at least 1, got {value}")
    labels = np.asarray(task.labels)
    graph = graph_of(labels)
    if cells is None:
        terminals = _all_regions(graph, min_cells)
    else:
        terminals = _nodes_of(graph, arguments.as_cells("cells", np.asarray(cells)))
    flags, costs = np.asarray(task.destroyable), np.asarray(task.removal_cost)
    price = {int(one): Fraction(float(costs[one])) for one in np.flatnonzero(flags)}
    nowhere = np.zeros(labels.shape[1:], bool)
    if not terminals:
        return Connection((), 0.0, 0.0, nowhere)
    found = search(graph, price, terminals, max_branches)
    if found.gone is None or found.cost is None or found.bound is None:
        return Connection((), float("inf"), float("inf"), nowhere)
    is_walkable = np.array([is_open(owners, found.gone) for owners in graph.owners])
    number = regions(is_walkable[graph.of_cell])
    joined = number == number[graph.of_cell == terminals[0]][0]
    return Connection(
        tuple(sorted(found.gone)), _rounded_down(found.cost), _rounded_down(found.bound), joined
    )


def _all_regions(graph: Graph, min_cells: int) -> list[int]:
    counts = np.bincount(graph.of_cell.ravel())
    return [
        node for node, owners in enumerate(graph.owners) if not owners and counts[node] >= min_cells
    ]


def _nodes_of(graph: Graph, cells: Array) -> list[int]:
    """The nodes of the cells, each once."""
    if cells.ndim != 2:
        raise ValueError(f"cells must have shape [k, 2], got {list(cells.shape)}")
    nodes: dict[int, None] = {}
    for row, col in cells.tolist():
        height, width = graph.of_cell.shape
        is_inside = 0 <= row < height and 0 <= col < width
        node = int(graph.of_cell[row, col]) if is_inside else -1
        if not is_inside or OUTSIDE in graph.owners[node]:
            raise ValueError(
                f"cells holds ({row}, {col}), which lies outside the map of {height} x {width}"
            )
        nodes[node] = None
    return list(nodes)


def _rounded_down(value: Fraction) -> float:
    """The greatest float32 that is no more than a value."""
    most = np.finfo(np.float32).max
    rounded = np.float32(min(float(value), float(most)))
    if Fraction(float(rounded)) > value:
        rounded = np.nextafter(rounded, np.float32(0))
    return float(rounded)
