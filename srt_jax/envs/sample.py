"""Levels drawn inside jit, always solvable: walls and fences in segments, and rooms whose doors are
closed by posts.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from srt_jax.engine.arguments import require_key
from srt_jax.envs.levels import Levels
from srt_jax.types import FREE, Array

KINDS = ("walls", "fences", "rooms")
_PRICES = (0.5, 1.0, 1.0, 2.0, 3.0)
_BARRIERS, _SEGMENTS = 3, 4
_ROOMS = 3


@functools.partial(jax.jit, static_argnames=("count", "kind", "size"))
def sample_levels(key: Array, *, count: int, kind: str = "rooms", size: int = 16) -> Levels:
    """Returns levels of square maps, each with a solution; the oracle is not run (`with_oracle`
    runs it). May be traced.

    walls: three walls from edge to edge in four segments each, some fixed, one in each at least
      destroyable. fences: the same
    with nothing fixed. rooms: 3 x 3 rooms between fixed walls; in every wall between two a door,
    open or closed by a post.

    Args:
      key: a JAX random key [].
      count, kind, size: static; size at least 12 cells.

    Raises:
      TypeError: no key. ValueError: an unknown kind, or a number out of range.

    Examples:
      >>> import jax
      >>> from srt_jax import envs
      >>> levels = envs.sample_levels(jax.random.key(0), count=2, size=12)
      >>> levels.labels.shape
      (2, 1, 12, 12)
    """
    require_key(key)
    if kind not in KINDS:
        raise ValueError(
            f"unknown kind {kind!r} of sampled levels: choose one of {', '.join(KINDS)}"
        )
    if count < 1 or size < 12:
        raise ValueError(
            f"count must be at least 1 and size at least 12, got count {count}, size {size}"
        )
    draw = _rooms if kind == "rooms" else functools.partial(_walls, is_fence=kind == "fences")
    labels, price, start, goal = jax.vmap(functools.partial(draw, size=size))(
        jax.random.split(key, count)
    )
    unknown = jnp.full(count, jnp.nan, jnp.float32)
    sizes = jnp.full((count, 2), size, jnp.int32)
    return Levels(
        labels=labels[:, None],
        price=price,
        start=start,
        goal=goal,
        size=sizes,
        removal=unknown,
        length=unknown,
    )


def _draw_prices(key: Array, shape: tuple[int, ...]) -> Array:
    return jnp.asarray(np.array(_PRICES, np.float32))[
        jax.random.randint(key, shape, 0, len(_PRICES), jnp.int32)
    ]


def _walls(key: Array, *, size: int, is_fence: bool) -> tuple[Array, ...]:
    keys = jax.random.split(key, 6)
    band = (size - 2) // _BARRIERS
    inner = jax.random.randint(keys[0], (_BARRIERS,), 0, band - 1, jnp.int32)
    rows = 1 + band * jnp.arange(_BARRIERS, dtype=jnp.int32) + inner
    segment = jnp.minimum(jnp.arange(size, dtype=jnp.int32) * _SEGMENTS // size, _SEGMENTS - 1)
    is_on = jnp.arange(size, dtype=jnp.int32)[:, None] == rows[None, :]  # [size, barriers]
    which = jnp.where(is_on.any(axis=1), lax.argmax(is_on, 1, jnp.int32), -1)
    labels = jnp.where(which[:, None] >= 0, which[:, None] * _SEGMENTS + segment[None, :], FREE)
    price = _draw_prices(keys[1], (_BARRIERS, _SEGMENTS))
    if not is_fence:
        is_fixed = jax.random.bernoulli(keys[2], jnp.float32(0.5), (_BARRIERS, _SEGMENTS))
        spared = jax.random.randint(keys[3], (_BARRIERS, 1), 0, _SEGMENTS, jnp.int32)
        is_fixed &= jnp.arange(_SEGMENTS, dtype=jnp.int32)[None] != spared
        price = jnp.where(is_fixed, jnp.inf, price)
    cols = jax.random.randint(keys[4], (2,), 0, size, jnp.int32)
    ends = jnp.stack(
        [jnp.stack([jnp.int32(0), cols[0]]), jnp.stack([jnp.int32(size - 1), cols[1]])]
    )
    is_flipped, is_turned = jax.random.bernoulli(keys[5], jnp.float32(0.5), (2,))
    ends = jnp.where(is_flipped, ends[::-1], ends)
    labels, ends = jnp.where(is_turned, labels.T, labels), jnp.where(is_turned, ends[:, ::-1], ends)
    return labels, price.reshape(-1), ends[0], ends[1]


def _rooms(key: Array, *, size: int) -> tuple[Array, ...]:
    """Walls are obstacle 0; the posts, two directions of (rooms - 1) x rooms, come after it; an
    open door is a free cell.
    """
    # The walls, which do not depend on the key.
    keys = jax.random.split(key, 5)
    edges = np.array([-1, *(i * size // _ROOMS for i in range(1, _ROOMS)), size], np.int32)
    row, col = np.mgrid[:size, :size].astype(np.int32)
    walls = np.isin(row, edges) | np.isin(col, edges)
    labels = jnp.asarray(np.where(walls, 0, FREE).astype(np.int32))
    # A door in each piece of wall between two rooms, open or closed by its post.
    number = (_ROOMS - 1) * _ROOMS
    places = jax.random.uniform(keys[0], (2, number), jnp.float32)
    is_open = jax.random.bernoulli(keys[1], jnp.float32(0.25), (2, number))
    for axis in range(2):
        for index in range(number):
            wall, room = edges[1 + index // _ROOMS], index % _ROOMS
            low, high = int(edges[room]) + 1, int(edges[room + 1])
            place = low + (places[axis, index] * (high - low)).astype(jnp.int32).clip(
                0, high - low - 1
            )
            door = jnp.where(
                is_open[axis, index], jnp.int32(FREE), jnp.int32(1 + axis * number + index)
            )
            here = (int(wall), place) if axis == 0 else (place, int(wall))
            labels = jnp.where((row == here[0]) & (col == here[1]), door, labels)
    price = jnp.concatenate(
        [jnp.full(1, jnp.inf, jnp.float32), _draw_prices(keys[2], (2 * number,))]
    )
    # Start and goal: a cell each of two different rooms.
    rooms = jax.random.choice(
        keys[3], jnp.arange(_ROOMS * _ROOMS, dtype=jnp.int32), (2,), replace=False
    )
    rooms = jnp.stack([rooms // _ROOMS, rooms % _ROOMS], axis=1)  # [2 ends, 2]
    lows, highs = jnp.asarray(edges[:-1] + 1)[rooms], jnp.asarray(edges[1:])[rooms]
    inside = (
        jax.random.uniform(keys[4], (2, 2), jnp.float32) * (highs - lows).astype(jnp.float32)
    ).astype(jnp.int32)
    ends = lows + jnp.minimum(inside, highs - lows - 1)
    return labels, price, ends[0], ends[1]
