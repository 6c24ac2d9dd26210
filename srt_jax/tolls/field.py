"""The least sum of length and tolls to every cell of a map: `cost_to_come` for maps on which
obstacles can be entered at a price.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.ground.marks import compiled_whole, jitted
from srt_jax.engine import arguments, cores, eager
from srt_jax.engine.batching import batch_kernel, each
from srt_jax.engine.buckets import batch_bucket, map_bucket
from srt_jax.engine.packing import pack
from srt_jax.fields import fixed_point
from srt_jax.padding import padded_labels
from srt_jax.tolls import entry
from srt_jax.tolls.spread import UNREACHED, Size, ground_of, sums_of
from srt_jax.types import FREE, Array


def toll_to_come(labels: Array, toll: Array, start: Array) -> Array:
    """Returns the least sum of length and tolls from `start` to each cell; inf where none leads,
    and everywhere if the start is covered.

    A move pays the toll of every obstacle that it needs gone and that the cell left does not lie
    in: those that cover the cell entered, and on a diagonal those that cover a cell beside it, as
    the library's corner rule wants them gone. So an obstacle that is left and entered again is paid
    again: what one way costs with everything paid once, `solve` with mode "shortest" finds.

    Sums are whole numbers of the map's fixed point, tolls rounded to it (1/5741 cell side on maps
    of up to 700 cells a side), so they do not depend on order, batch or machine; with no obstacle
    entered they are the lengths of `cost_to_come`. Sums from about 370,000 cell sides on count as
    inf.

    Args:
      labels: int32 [..., L, H, W], as in `Task`.
      toll: float32 [..., M], of each obstacle, in cell sides, not negative; inf of one that may not
        be entered.
      start: int32 [..., 2], (row, col); may lie outside the map.

    Returns:
      float32 [..., H, W], in cell sides.

    Raises:
      TypeError, ValueError: for a dtype or a shape that does not fit; outside jit, for a toll that
        is negative or not a number.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> print(srt_jax.toll_to_come(task.labels, np.array([20], np.float32), task.start)[2])
      [ 0.  1.  2. 23. 24. 25. 26.]
    """
    start, toll = arguments.as_cells("start", start), arguments.as_floats("toll", toll, core_rank=1)
    if getattr(labels, "dtype", None) != np.int32:
        raise TypeError(
            "labels must be int32, ids as in Task (-1 free), got"
            f" {getattr(labels, 'dtype', type(labels))}"
        )
    if labels.ndim < 3 or 0 in labels.shape[-3:]:
        raise ValueError(
            f"labels must have shape [..., L, H, W] with no empty side, got {list(labels.shape)}"
        )
    batch = arguments.common_batch(labels=(labels, 3), toll=(toll, 1), start=(start, 1))
    if arguments.is_traced(labels, toll, start):
        folded = (arguments.fold(x, rank) for x, rank in ((labels, 3), (toll, 1), (start, 1)))
        return arguments.unfold(_program()(*folded), batch)
    if not (np.asarray(toll) >= 0).all():
        wrong = np.asarray(toll)[~(np.asarray(toll) >= 0)][0]
        raise ValueError(f"toll holds {wrong}: a toll is not negative, inf forbids to enter")

    def run() -> jax.Array:
        folded = [eager.fold(x, rank) for x, rank in ((labels, 3), (toll, 1), (start, 1))]
        return eager.unfold(_in_bucket(*map(np.asarray, folded)), batch)

    return cores.at_device_of(run, labels, toll, start)


def _in_bucket(labels: np.ndarray, toll: np.ndarray, start: np.ndarray) -> np.ndarray:
    """The sums, computed on arrays padded to bucketed shapes, so that few are ever compiled."""
    B, L, H, W = labels.shape
    shape = (batch_bucket(B), batch_bucket(L), *map_bucket(H, W))
    room = max(8, batch_bucket(toll.shape[1])) - toll.shape[1]
    tolls = np.pad(toll, ((0, shape[0] - B), (0, room)), constant_values=np.inf)
    starts = np.pad(start, ((0, shape[0] - B), (0, 0)))
    return np.asarray(_program()(padded_labels(labels, shape), tolls, starts))[:B, :H, :W]


@functools.cache
def _program():
    return jitted(_toll_maps, name=eager.name_of(_toll_maps))


def _toll_maps(labels: Array, toll: Array, start: Array) -> Array:
    """`toll_to_come` of a batch: int32 [B, L, H, W], float32 [B, M], int32 [B, 2]."""
    return batch_kernel(compiled_whole(functools.partial(each, _toll_map)))(labels, toll, start)


def _toll_map(labels: Array, toll: Array, start: Array) -> Array:
    size = Size(*labels.shape[1:])
    may_enter = jnp.concatenate([jnp.array(np.array([False, True])), toll < jnp.inf])
    openable = jnp.take(may_enter, labels + 2, mode="clip").all(axis=0)
    scale = jnp.asarray(fixed_point.finest_scale_within(pack(openable[None])[0], size.width))
    scale = scale.astype(jnp.int32)
    straight, diagonal = (cost.astype(jnp.uint32) for cost in fixed_point.pairs(scale))
    nowhere = jnp.array(np.array([-1, -1], np.int32))
    ground = ground_of(labels, straight, diagonal, start, nowhere, size)
    own = lax.dynamic_index_in_dim(ground.labels, ground.start, keepdims=False)
    is_free = (own == FREE).all()
    ground = ground._replace(start=jnp.where(is_free, ground.start, jnp.uint32(0)))
    tolls = entry.with_ends(entry.in_units(toll, straight))
    sums = sums_of(ground, tolls, jnp.uint32(UNREACHED - 1), size)
    sums = sums.reshape(size.height + 2, size.stride)[1:-1, 1:-1]
    return fixed_point.length_where(sums < UNREACHED, sums.astype(jnp.int32), scale)
