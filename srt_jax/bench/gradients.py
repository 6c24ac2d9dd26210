"""`srt-jax bench gradients`: least costs over cells of unequal cost, forwards and backwards, beside
SciPy's Dijkstra.

Medians of several runs in one process, one thread each. "back / forward" is the time of
value_and_grad less that of the value, over that of the value. The last line is the compiled memory
of the gradient, without arguments and results, for a snake and an open map of equal size.
"""

import json
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from srt_jax.bench.machine import machine, machine_line, spread
from srt_jax.bench.timing import in_turn, measured_apart

SIDE = 512
QUICK_SIDE = 128


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "rows", "temporary_bytes": {map: bytes}}, measured in a process of
    its own.

    A row: {map, costs, size, scipy_ms or None where SciPy is missing, forward_ms, backward_ms}.
    """
    one_thread = {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false", "OMP_NUM_THREADS": "1"}
    return measured_apart("srt_jax.bench.gradients", quick, **one_thread)


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text."""
    lines = [
        f"{machine_line(result['machine'])}, one thread",
        f"{'map':12}{'costs':8}{'size':>6}{'SciPy ms':>10}{'forward':>10}{'backward':>10}"
        f"{'SciPy / forward':>16}{'back / forward':>16}",
    ]
    for row in result["rows"]:
        forward, backward, peer = row["forward_ms"], row["backward_ms"], row["scipy_ms"]
        against = f"{peer:10.1f}" if peer else f"{'-':>10}"
        ratio = f"{peer / forward:16.2f}" if peer else f"{'-':>16}"
        lines.append(
            f"{row['map']:12}{row['costs']:8}{row['size']:6d}{against}{forward:10.1f}"
            f"{backward:10.1f}{ratio}{backward / forward:16.2f}"
        )
    memory = ", ".join(f"{name} {size}" for name, size in result["temporary_bytes"].items())
    lines.append(f"temporary bytes of the gradient: {memory}")
    return "\n".join(lines)


def _measure(quick: bool) -> dict[str, Any]:
    from srt_jax.bench.measured_maps import KINDS

    side, kinds = (QUICK_SIDE, ("open", "maze 1")) if quick else (SIDE, ("open", *KINDS))
    rows = [
        _measure_map(kind, costs, side, 3 if quick else 5)
        for kind in kinds
        for costs in ("hills", "noise")
    ]
    snake = np.zeros((side, side), bool)
    snake[::2] = snake[1::4, -1] = snake[3::4, 0] = True
    memory = {
        "snake": _temporary_bytes(snake),
        "open map": _temporary_bytes(np.ones_like(snake)),
    }
    return {"machine": machine("scipy"), "rows": rows, "temporary_bytes": memory}


def _measure_map(kind: str, cost_kind: str, side: int, repeats: int) -> dict[str, Any]:
    import jax
    import jax.numpy as jnp

    import srt_jax
    from srt_jax.bench.measured_maps import maps_of

    free, start = (array[0] for array in maps_of("noise 0 %" if kind == "open" else kind, side, 1))
    costs = _costs_of(cost_kind, side)
    field = jax.jit(srt_jax.cost_to_come)

    def total(costs: jax.Array, free: jax.Array, start: jax.Array) -> jax.Array:
        cost = srt_jax.cost_to_come(free, start, costs)
        return jnp.where(jnp.isfinite(cost), cost, 0).sum()

    both = jax.jit(jax.value_and_grad(total))
    free_, start_, costs_ = (jnp.asarray(array) for array in (free, start, costs))
    functions: dict[str, Callable[[], Any]] = {
        "forward": lambda: jax.block_until_ready(field(free_, start_, costs_)),
        "both": lambda: jax.block_until_ready(both(costs_, free_, start_)),
        **_scipy(free, start, costs),
    }
    taken = in_turn(functions, repeats)
    milliseconds = {name: 1e3 * spread(seconds)["median"] for name, seconds in taken.items()}
    return {
        "map": kind,
        "costs": cost_kind,
        "size": side,
        "scipy_ms": milliseconds.get("scipy"),
        "forward_ms": milliseconds["forward"],
        "backward_ms": milliseconds["both"] - milliseconds["forward"],
    }


def _costs_of(kind: str, side: int) -> np.ndarray:
    """Cell costs, float32 [side, side]: hills, or a number of its own for every cell."""
    y, x = np.mgrid[:side, :side]
    hills = 1 + 4 * (np.sin(x / 40) * np.cos(y / 55)) ** 2
    noise = np.random.default_rng(0).uniform(1, 10, (side, side))
    return (hills if kind == "hills" else noise).astype(np.float32)


def _scipy(free: np.ndarray, start: np.ndarray, costs: np.ndarray) -> dict[str, Callable[[], Any]]:
    """The peer, {} where SciPy is not installed; building its graph is not timed."""
    try:
        from scipy.sparse import csgraph
    except ModuleNotFoundError:
        return {}
    moves = _graph(free, costs)
    source = int(start[0]) * free.shape[1] + int(start[1])
    return {"scipy": lambda: csgraph.dijkstra(moves, directed=False, indices=source)}


def _graph(free: np.ndarray, costs: np.ndarray) -> Any:
    """The moves of one map as a sparse matrix of lengths, the form that SciPy takes."""
    from scipy import sparse

    cell = np.arange(free.size).reshape(free.shape)
    up, down, left, right = (
        slice(-1),
        slice(1, None),
        (slice(None), slice(-1)),
        (slice(None), slice(1, None)),
    )
    # A diagonal move needs all four cells of its square.
    square = free[up, up] & free[up, down] & free[down, up] & free[down, down]
    pairs = [(left, right, free[left] & free[right], 1.0), (up, down, free[up] & free[down], 1.0)]
    pairs += [((up, up), (down, down), square, 2**0.5), ((up, down), (down, up), square, 2**0.5)]
    tail, head = (np.concatenate([cell[pair[side]][pair[2]] for pair in pairs]) for side in (0, 1))
    cost = np.concatenate(
        [(costs[a].astype(float) + costs[b])[ok] / 2 * length for a, b, ok, length in pairs]
    )
    return sparse.csr_matrix(sparse.coo_matrix((cost, (tail, head)), (free.size, free.size)))


def _temporary_bytes(free: np.ndarray) -> int:
    """Memory of the compiled gradient beside its arguments and results."""
    import jax
    import jax.numpy as jnp

    import srt_jax

    def total(costs: jax.Array, free: jax.Array) -> jax.Array:
        cost = srt_jax.cost_to_come(free, (0, 0), costs)
        return jnp.where(jnp.isfinite(cost), cost, 0).sum()

    compiled = jax.jit(jax.grad(total)).lower(jnp.ones(free.shape, jnp.float32), free).compile()
    memory = compiled.memory_analysis()
    return memory.temp_size_in_bytes if memory else 0


if __name__ == "__main__":
    print(json.dumps(_measure("--quick" in sys.argv)))
