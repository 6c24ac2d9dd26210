"""Least costs over cells of unequal cost, forwards and backwards, beside SciPy's Dijkstra: `python
-m srt_jax.bench.gradients`.

Medians of several runs in one process, one thread each; `back / forward` is value_and_grad less the
value, over the value. The last line is the compiled memory of value_and_grad, without arguments and
results, for a snake and an open map of equal size.
"""

import sys
import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

import srt_jax
from srt_jax.bench.measured_maps import KINDS, maps_of

SIDE = 512


def graph(free: np.ndarray, costs: np.ndarray) -> sparse.csr_matrix:
    """The moves of one map as SciPy takes them; building it is not timed."""
    cell = np.arange(free.size).reshape(free.shape)
    up, down, left, right = (
        slice(-1),
        slice(1, None),
        (slice(None), slice(-1)),
        (slice(None), slice(1, None)),
    )
    square = free[up, up] & free[up, down] & free[down, up] & free[down, down]
    pairs = [(left, right, free[left] & free[right], 1.0), (up, down, free[up] & free[down], 1.0)]
    pairs += [((up, up), (down, down), square, 2**0.5), ((up, down), (down, up), square, 2**0.5)]
    tail, head = (np.concatenate([cell[pair[side]][pair[2]] for pair in pairs]) for side in (0, 1))
    cost = np.concatenate(
        [(costs[a].astype(float) + costs[b])[ok] / 2 * length for a, b, ok, length in pairs]
    )
    return sparse.coo_matrix((cost, (tail, head)), (free.size, free.size)).tocsr()


def median_seconds(run: Callable, repeats: int = 5) -> float:
    run()
    seconds = []
    for _ in range(repeats):
        begin = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - begin)
    return float(np.median(seconds))


def costs_of(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Cell costs, float32 [SIDE, SIDE]: hills, or a number of its own for every cell."""
    y, x = np.mgrid[:SIDE, :SIDE]
    hills = 1 + 4 * (np.sin(x / 40) * np.cos(y / 55)) ** 2
    return (hills if kind == "hills" else rng.uniform(1, 10, (SIDE, SIDE))).astype(np.float32)


def measure(kind: str, cost_kind: str) -> str:
    free, start = (array[0] for array in maps_of("noise 0 %" if kind == "open" else kind, SIDE, 1))
    costs, weights = (
        costs_of(cost_kind, np.random.default_rng(0)),
        np.ones((SIDE, SIDE), np.float32),
    )
    peer = graph(free, costs)
    field = jax.jit(srt_jax.cost_to_come)

    def total(costs: jax.Array, free: jax.Array, start: jax.Array, weights: jax.Array) -> jax.Array:
        cost = srt_jax.cost_to_come(free, start, costs)
        return jnp.where(jnp.isfinite(cost), cost * weights, 0).sum()

    both = jax.jit(jax.value_and_grad(total))
    args = [jnp.asarray(array) for array in (free, start, costs, weights)]
    scipys = median_seconds(
        lambda: csgraph.dijkstra(peer, directed=False, indices=start[0] * SIDE + start[1])
    )
    forward = median_seconds(lambda: jax.block_until_ready(field(*args[:3])))
    there_and_back = median_seconds(
        lambda: jax.block_until_ready(both(args[2], args[0], args[1], args[3]))
    )
    return (
        f"{kind:12}{cost_kind:8}{scipys * 1e3:10.1f}{forward * 1e3:10.1f}{(there_and_back - forward) * 1e3:10.1f}"
        f"{scipys / forward:16.2f}{there_and_back / forward - 1:16.2f}"
    )


def temporary_bytes(free: np.ndarray) -> int:
    """Memory of the compiled gradient beside its arguments and results."""

    def total(costs: jax.Array, free: jax.Array) -> jax.Array:
        cost = srt_jax.cost_to_come(free, (0, 0), costs)
        return jnp.where(jnp.isfinite(cost), cost, 0).sum()

    compiled = jax.jit(jax.grad(total)).lower(jnp.ones(free.shape, jnp.float32), free).compile()
    return compiled.memory_analysis().temp_size_in_bytes


def main() -> int:
    print(
        f"{'map':12}{'costs':8}{'SciPy ms':>10}{'forward':>10}{'backward':>10}{'SciPy / forward':>16}{'back / forward':>16}"
    )
    for kind in ("open", *KINDS):
        for cost_kind in ("hills", "noise"):
            print(measure(kind, cost_kind), flush=True)
    snake = np.zeros((SIDE, SIDE), bool)
    snake[::2] = snake[1::4, -1] = snake[3::4, 0] = True
    print(
        f"temporary bytes: snake {temporary_bytes(snake)}, open map"
        f" {temporary_bytes(np.ones_like(snake))}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
