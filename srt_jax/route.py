"""Which obstacles a route needs gone, and when: the agent destroys each from the last cell before it is first in the way.

Stepping from one cell to the next needs every owner of the next cell gone, and on a diagonal the owners of both cells beside
it. All of these are neighbours of the cell stepped from, so they can be destroyed from there: any shortest path on the map
without the chosen obstacles is a route, and no route that destroys only these is shorter.
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.kernel import compiled_whole, each
from srt_jax.types import Array

NEVER = np.int32(2**31 - 1)
"""The index at which an obstacle is needed that is not needed at all."""


def first_needed(labels: Array, cells: Array, num_cells: Array, *, num_obstacles: int) -> Array:
    """Returns, for every obstacle, the index into `cells` from which it must be destroyed; NEVER where it is not in the way.

    Args:
      labels: int32 [B, L, H, W].
      cells: int32 [B, N, 2], a route.
      num_cells: int32 [B]; routes that do not fit N cells count as empty.

    Returns:
      int32 [B, M].
    """
    L, N = labels.shape[1], cells.shape[1]
    if N < 2:  # no room for a move
        return jnp.full((labels.shape[0], num_obstacles), NEVER, jnp.int32)

    def note(needed, owner, index):
        place = jnp.where(owner < 0, num_obstacles, owner)  # the last place takes what belongs to no obstacle
        known = lax.dynamic_slice(needed, (place,), (1,))
        return lax.dynamic_update_slice(needed, jnp.minimum(known, index), (place,))

    def walk_all(labels, cells, num_cells):
        # Reads single cells of the whole batch: a map cut out of it would be copied.
        def walk(which, num):
            def step(index, needed):
                (row, col), (to_row, to_col) = lax.dynamic_slice(cells, (which, index, jnp.int32(0)), (1, 2, 2))[0]
                for layer in range(L):
                    for r, c in ((to_row, to_col), (to_row, col), (row, to_col)):
                        owner = lax.dynamic_slice(labels, (which, jnp.int32(layer), r, c), (1, 1, 1, 1))[0, 0, 0, 0]
                        needed = note(needed, owner, index)
                return needed

            return lax.fori_loop(0, num - 1, step, jnp.full(num_obstacles + 1, NEVER, jnp.int32))[:num_obstacles]

        return each(walk, jnp.arange(cells.shape[0], dtype=jnp.int32), num_cells)

    return compiled_whole(walk_all)(labels, cells, jnp.where(num_cells <= N, num_cells, 0))


def in_order(needed: Array, *, max_destroyed: int) -> tuple[Array, Array, Array]:
    """Returns the obstacles needed, in the order of need (ties: lowest id), with their indices, and how many there are.

    Args:
      needed: int32 [B, M], from `first_needed`.

    Returns:
      ids int32 [B, K], -1 after the last; indices int32 [B, K], -1 likewise; the true number int32 [B], perhaps more than K.
    """
    num_obstacles = needed.shape[1]
    count = (needed < NEVER).sum(axis=1, dtype=jnp.int32)
    ids_of = jnp.broadcast_to(jnp.arange(num_obstacles, dtype=jnp.int32), needed.shape)
    at, ids = lax.sort((needed, ids_of), dimension=1, num_keys=2)
    missing = max(0, max_destroyed - num_obstacles)
    at, ids = (jnp.pad(x, ((0, 0), (0, missing)), constant_values=NEVER)[:, :max_destroyed] for x in (at, ids))
    is_one = at < NEVER
    return jnp.where(is_one, ids, -1), jnp.where(is_one, at, -1), count
