"""How a call about coalitions reaches its kernel: any batch folded into one axis, padded to few
shapes, in parts on all cores, and cropped again.
"""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.loops import hidden_zero
from sign_model.foundation.marks import compiled_whole
from srt_jax.coalition.task import NOWHERE, CoalitionTask
from srt_jax.engine import cores, eager
from srt_jax.engine.arguments import common_batch, fold, is_traced, require_forms, unfold
from srt_jax.engine.buckets import batch_bucket, map_bucket
from srt_jax.obstacles import Labels
from srt_jax.padding import padded_labels
from srt_jax.types import Array

_FORM = {
    "labels": (np.int32, 3),
    "removal_cost": (np.float32, 1),
    "able": (np.bool_, 2),
    "start": (np.int32, 2),
    "goal": (np.int32, 2),
    "size": (np.int32, 1),
}
"""dtype and rank of each array of one task."""


def coalition_batch(task: CoalitionTask) -> tuple[int, ...]:
    """Returns the batch dimensions of a task; TypeError or ValueError that names the array that
    does not fit the others.
    """
    require_forms(task, _FORM)
    agents, obstacles = task.able.shape[-2:]
    for name, core in (
        ("removal_cost", (obstacles,)),
        ("start", (agents, 2)),
        ("goal", (agents, 2)),
        ("size", (2,)),
    ):
        shape = getattr(task, name).shape
        if shape[len(shape) - len(core) :] != core:
            raise ValueError(
                f"task.{name} must end with dimensions {list(core)}, got {list(shape)}"
            )
    return common_batch(**{name: (getattr(task, name), rank) for name, (_, rank) in _FORM.items()})


def call(
    kernel: Callable[[Any, bool], Callable[[CoalitionTask], Any]],
    task: CoalitionTask,
    options: Any,
    axes: dict[str, str],
    *,
    room: int | None = None,
    finish: Callable[[Any, int, int], Any] | None = None,
) -> Any:
    """Returns what a kernel gives for a task or a batch of tasks.

    Args:
      kernel: (options, is_part) -> a jitted function of a batch with one leading axis, which
        returns a record; the same function for equal options. Where `room` is given, it is the
        second argument, int32 [B].
      options: hashable.
      axes: for each array of the record whose axes after the first are padded: "A", "M", "H", "W"
        for those to crop, "N" for the room, "." for others.
      finish: (record, height, width) -> the record of an eager call, on the host, where its kernel
        returns another.
    """
    batch = coalition_batch(task)
    ranks = CoalitionTask(**{name: rank for name, (_, rank) in _FORM.items()})
    if is_traced(task):
        flat = jax.tree.map(fold, task, ranks)
        out = kernel(options, False)(flat, *_rooms(room, len(flat.start), jnp))
        return jax.tree.map(lambda array: unfold(array, batch), out)
    flat = jax.tree.map(eager.fold, task, ranks)

    def run() -> Any:
        out = _in_buckets(kernel, flat, options, axes, room)
        if finish is not None:
            out = finish(out, *flat.labels.shape[-2:])
        return eager.unfold(out, batch)

    return cores.at_device_of(run, *jax.tree.leaves(task))


def _rooms(room: int | None, count: int, xp: ModuleType) -> tuple:
    return () if room is None else (xp.full(count, room, np.int32),)


def _in_buckets(
    kernel: Callable,
    task: CoalitionTask,
    options: Any,
    axes: dict[str, str],
    room: int | None,
) -> Any:
    B, L, H, W = task.labels.shape
    A, M = task.able.shape[1:]
    bucket = (batch_bucket(B), batch_bucket(L), *map_bucket(H, W), batch_bucket(A))
    shape = (*bucket, _obstacle_bucket(M))
    is_on_host = cores.is_on_host(*jax.tree.leaves(task))
    size = cores.part_size(bucket[0], A * H * W * L, cores.SOLVE) if is_on_host else bucket[0]
    run_bucket = kernel(options, size < B)
    sides = {"A": A, "M": M, "H": H, "W": W, "N": room}

    def run(part: CoalitionTask) -> Any:
        count = len(part.start)
        out = run_bucket(pad_batch(part, (size, *shape[1:])), *_rooms(room, size, np))
        cropped = {
            name: np.asarray(array)[
                (slice(count), *(slice(sides.get(axis)) for axis in axes.get(name, "")))
            ]
            for name, array in out.items()
        }
        return out.replace(**cropped)

    return run(task) if size >= B else cores.in_parts(run, task, size, (run_bucket, shape, room))


def _obstacle_bucket(count: int) -> int:
    """Returns the number of obstacles to which `count` is padded: with what stands for the outside
    of the map they fill whole words.
    """
    return max(32, batch_bucket(count + 1)) - 1


def pad_batch(task: CoalitionTask, shape: tuple[int, ...]) -> CoalitionTask:
    """Returns a batch padded on the host to `shape` (B, L, H, W, A, M); what is added does
    nothing.
    """
    B = len(task.start)
    host = jax.tree.map(np.asarray, task)
    b, a, m = shape[0] - B, shape[4] - task.able.shape[1], shape[5] - task.able.shape[2]
    nowhere = {"pad_width": ((0, b), (0, a), (0, 0)), "constant_values": NOWHERE[0]}
    return CoalitionTask(
        labels=padded_labels(host.labels, shape[:4]),
        removal_cost=np.pad(host.removal_cost, ((0, b), (0, m)), constant_values=1),
        able=np.pad(host.able, ((0, b), (0, a), (0, m))),
        start=np.pad(host.start, **nowhere),
        goal=np.pad(host.goal, **nowhere),
        size=np.pad(host.size, ((0, b), (0, 0))),
    )


def of_all(
    fun: Callable[..., tuple[Any, Any]], room: Callable[[], Any], labels: Array, *args: Array
) -> Any:
    """Returns the outcome of fun(labels of one map, room, ...) for each map of a batch, one after
    the other in a marked call; `fun` returns it with the room, which the next map uses again.
    """

    def all_maps(labels: Array, *args: Array) -> Any:
        count = len(labels)
        entries = (jnp.arange(count, dtype=jnp.int32), *args)

        def one(which: Array, room: Any, *entry: Array) -> tuple[Any, Any]:
            return fun(Labels(labels, which), room, *entry)

        first = jax.tree.map(lambda leaf: leaf[0], entries)
        form = jax.eval_shape(one, first[0], room(), *first[1:])[0]
        empty = jax.tree.map(lambda leaf: jnp.zeros((count, *leaf.shape), leaf.dtype), form)

        def step(i: Array, state: tuple[Any, Any]) -> tuple[Any, Any]:
            out, here = state
            entry = [lax.dynamic_index_in_dim(leaf, i, keepdims=False) for leaf in entries]
            new, here = one(entry[0], here, *entry[1:])
            put = lambda whole, leaf: lax.dynamic_update_index_in_dim(whole, leaf, i, 0)  # noqa: E731
            return jax.tree.map(put, out, new), here

        # the compiler does not know the number of steps: it would remove a loop of one
        steps = jnp.int32(count) + hidden_zero(labels)
        return lax.fori_loop(jnp.int32(0), steps, step, (empty, room()))[0]

    return compiled_whole(all_maps)(labels, *args)
