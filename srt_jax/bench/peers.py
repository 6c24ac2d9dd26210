"""The native peers, each a function that does all maps of a batch; those that are not installed are
left out by name.
"""

import ctypes
import importlib
from collections.abc import Callable
from typing import Any

import numpy as np

from srt_jax.bench.native import compiled
from srt_jax.bench.paper_pipeline import paper_pipeline
from srt_jax.moves import FIXED_POINTS

Peers = dict[str, Callable[[], Any]]


def module(name: str) -> Any | None:
    """Returns the module, or None where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def floods(maps: np.ndarray, starts: np.ndarray) -> Peers:
    """Peers of reach: the mask of the part that holds the start."""
    byte, peers = maps.astype(np.uint8), {}
    if cv2 := module("cv2"):
        cv2.setNumThreads(1)

        def flood_fill() -> list:
            return [_filled(cv2, free, start, 4) for free, start in zip(byte, starts)]

        peers["cv2.floodFill"] = flood_fill
        peers["cv2.connectedComponents"] = _labelled(
            lambda free: cv2.connectedComponents(free, connectivity=4)[1], byte, starts
        )
    if cc3d := module("cc3d"):
        peers["cc3d"] = _labelled(
            lambda free: cc3d.connected_components(free, connectivity=4), byte, starts
        )
    if ndimage := module("scipy.ndimage"):
        peers["scipy.ndimage.label"] = _labelled(lambda free: ndimage.label(free)[0], byte, starts)
    return peers


def _filled(cv2: Any, mask: np.ndarray, cell: np.ndarray, connectivity: int) -> np.ndarray:
    image = mask.copy()
    cv2.floodFill(image, None, (int(cell[1]), int(cell[0])), 2, flags=connectivity)
    return image == 2


def _labelled(label: Callable, byte: np.ndarray, starts: np.ndarray) -> Callable:
    def run() -> list:
        return [
            labels == labels[tuple(start)]
            for labels, start in ((label(free), start) for free, start in zip(byte, starts))
        ]

    return run


def contours(maps: np.ndarray, seeds: np.ndarray, ahead: np.ndarray) -> Peers:
    """Peers of contour: flood the obstacle through corners, flood the seed's side, widen,
    intersect.
    """
    cv2 = module("cv2")
    if cv2 is None:
        return {}
    byte, square = maps.astype(np.uint8), np.ones((3, 3), np.uint8)

    def run() -> list:
        out = []
        for free, seed, blocked in zip(byte, seeds, ahead):
            obstacle = _filled(cv2, 1 - free, blocked, 8).astype(np.uint8)
            out.append(cv2.dilate(obstacle, square).astype(bool) & _filled(cv2, free, seed, 4))
        return out

    return {"cv2 flood + dilate": run}


def nearest(reached: np.ndarray, goals: np.ndarray) -> Peers:
    """Peers of seed_cell: the least of a table of distances, masked."""
    straight, diagonal = FIXED_POINTS[0]
    rows, cols = np.mgrid[: reached.shape[1], : reached.shape[2]].astype(np.int32)
    down, right = (np.abs(x - goals[0, i]) for i, x in enumerate((rows, cols)))
    h = np.maximum(down, right) * straight + np.minimum(down, right) * (diagonal - straight)
    return {"numpy where + argmin": lambda: [np.where(mask, h, 2**30).argmin() for mask in reached]}


def distances(maps: np.ndarray, starts: np.ndarray) -> Peers:
    """Peers of cost_to_come. dijkstra3d and skimage cut corners: they answer an easier question."""
    peers: Peers = {}
    if native := bucket_dijkstra():
        peers["C++ bucket Dijkstra"] = lambda: native(maps, starts)
    if dijkstra3d := module("dijkstra3d"):
        byte = [np.asfortranarray(free.astype(np.uint8)) for free in maps]
        peers["dijkstra3d"] = lambda: [
            dijkstra3d.euclidean_distance_field(free, tuple(map(int, start)))
            for free, start in zip(byte, starts)
        ]
    if csgraph := module("scipy.sparse.csgraph"):
        graphs = [move_graph(free) for free in maps]
        places = starts[:, 0] * maps.shape[2] + starts[:, 1]
        peers["scipy csgraph, graph given"] = lambda: [
            csgraph.dijkstra(graph, directed=False, indices=int(place))
            for graph, place in zip(graphs, places)
        ]
    if graph := module("skimage.graph"):
        costs = np.where(maps, 1.0, -1.0)
        peers["skimage MCP_Geometric"] = lambda: [
            graph.MCP_Geometric(cost).find_costs([tuple(start)])[0]
            for cost, start in zip(costs, starts)
        ]
    return peers


def routes(maps: np.ndarray, starts: np.ndarray, goals: np.ndarray) -> Peers:
    """Peers of shortest_path: jump point search in C++, cell by cell and on machine words; they
    give the length of one path.
    """
    peers: Peers = {}
    ends = [(tuple(start), tuple(goal)) for start, goal in zip(starts.tolist(), goals.tolist())]
    if pipeline := paper_pipeline():
        peers["C++ JPS"] = lambda: [pipeline.jps(free, *both)[0] for free, both in zip(maps, ends)]
    if library := compiled("word_jps"):

        def on_words() -> list[float]:
            lengths = []
            for free, (start, goal) in zip(maps, ends):
                length = ctypes.c_double()
                place = ctypes.c_void_p(free.ctypes.data)
                library.word_jps(place, *free.shape, *start, *goal, ctypes.byref(length))
                lengths.append(length.value)
            return lengths

        peers["C++ JPS on words"] = on_words
    return peers


def cuts(maps: np.ndarray, starts: np.ndarray, goals: np.ndarray) -> Peers:
    """Peers of critical_cells: one depth-first search in C++."""
    library = compiled("critical_cells")
    if library is None:
        return {}

    def run() -> np.ndarray:
        byte, cells = maps.view(np.uint8), np.empty(maps.shape, np.uint8)
        for free, start, goal, out in zip(byte, starts.tolist(), goals.tolist(), cells):
            place = ctypes.c_void_p(free.ctypes.data), ctypes.c_void_p(out.ctypes.data)
            library.critical_cells(place[0], *free.shape, *start, *goal, place[1])
        return cells

    return {"C++ depth-first search": run}


def tolled(labels: np.ndarray, toll: np.ndarray, starts: np.ndarray) -> Peers:
    """Peers of toll_to_come, one layer a map: labels int32 [B, H, W], toll float32 [B, M]."""
    library = compiled("toll_dijkstra")
    if library is None:
        return {}
    units = np.round(toll.astype(np.float64) * FIXED_POINTS[0][0]).astype(np.uint32)

    def run() -> np.ndarray:
        sums = np.empty(labels.shape, np.uint32)
        for owner, own, start, out in zip(labels, units, starts.tolist(), sums):
            places = [ctypes.c_void_p(array.ctypes.data) for array in (owner, own, out)]
            library.toll_dijkstra(*places[:2], *owner.shape, *start, places[2])
        return sums

    return {"C++ heap Dijkstra": run}


def move_graph(free: np.ndarray) -> Any:
    """Returns the legal moves of one map as a SciPy graph with exact integer costs."""
    from scipy import sparse

    straight, diagonal = FIXED_POINTS[0]
    cell = np.arange(free.size).reshape(free.shape)
    square = free[:-1, :-1] & free[1:, 1:] & free[:-1, 1:] & free[1:, :-1]
    kinds = (
        (cell[:, :-1], cell[:, 1:], free[:, :-1] & free[:, 1:], straight),
        (cell[:-1], cell[1:], free[:-1] & free[1:], straight),
        (cell[:-1, :-1], cell[1:, 1:], square, diagonal),
        (cell[:-1, 1:], cell[1:, :-1], square, diagonal),
    )
    tail, head, cost = (
        np.concatenate(parts)
        for parts in zip(
            *((a[ok], b[ok], np.full(ok.sum(), float(cost))) for a, b, ok, cost in kinds)
        )
    )
    return sparse.coo_matrix((cost, (tail, head)), (free.size, free.size)).tocsr()


def bucket_dijkstra() -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
    """Returns the C++ peer, compiled on the spot; None where there is no compiler."""
    library = compiled("bucket_dijkstra")
    if library is None:
        return None
    native = library.bucket_dijkstra

    def run(maps: np.ndarray, starts: np.ndarray) -> np.ndarray:
        byte, cost = maps.view(np.uint8), np.empty(maps.shape, np.int32)
        for free, (row, col), out in zip(byte, starts, cost):
            native(
                ctypes.c_void_p(free.ctypes.data),
                *free.shape,
                int(row),
                int(col),
                ctypes.c_void_p(out.ctypes.data),
            )
        return cost

    return run
