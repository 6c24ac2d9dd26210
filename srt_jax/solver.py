"""The whole task: the path where there is one; else what blocks, what to destroy, and the route
that does it.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.marks import jitted
from srt_jax.engine import cores, eager
from srt_jax.engine.arguments import common_batch, fold, is_traced, require_forms, unfold
from srt_jax.engine.batching import batch_kernel
from srt_jax.engine.buckets import SMALL_MAP, batch_bucket, map_bucket, obstacle_bucket
from srt_jax.engine.entrance import require_task
from srt_jax.engine.forks import refuse_fork
from srt_jax.engine.no_gradient import refuse_gradient
from srt_jax.engine.reuse import MOST, Bucket, Shapes, is_measuring, most_of_parts
from srt_jax.moves import max_path_cells
from srt_jax.obstacles import MANY
from srt_jax.padding import cut, pad_batch, with_cells, with_slots
from srt_jax.solver_kernel import answer_batch, way_of
from srt_jax.tolls.toll_option import toll_of_each
from srt_jax.types import Array, Solution, Task, of_task

MODES = ("least", "paper", "literal", "shortest")
MAX_BRANCHES = 256
"""Enough for all but a few tasks with many overlaps: see `python -m
experiments.campaigns.branches`.
"""

_NO_GRADIENT = (
    "solve has no gradient, as its answer is a choice: differentiate srt_jax.least_removal (mode"
    " least), srt_jax.least_total (mode shortest), or srt_jax.path_cost by costs of cells; or put"
    " jax.lax.stop_gradient around the costs that solve is given"
)

_shapes = Shapes()


def solve(
    task: Task,
    *,
    mode: str = "least",
    toll: float | Array = 1.0,
    max_destroyed: int = 8,
    max_cells: int | None = None,
    max_branches: int = MAX_BRANCHES,
) -> Solution:
    """Returns the route to the goal and what must be destroyed for it; `status` says what went
    wrong, nothing is raised.

    PY16 §3.2. Mode "least" destroys obstacles of the least total removal cost (`removal_bound`
    proves it where the two agree), then takes the shortest route for them; it destroys none that is
    not needed, even where `max_branches` ends the search. Modes "paper" and "literal" are the
    paper's greedy loop, read kindly or literally (`srt_jax.removal.paper_loop`): it destroys before
    it knows the rest of the way, hence perhaps what turns out not to be needed; read literally it
    may stop short of a goal that can be reached: STOPPED_SHORT. Mode "shortest" asks whether it is
    worth breaking even where a path exists: it takes the least sum of the route's length and of the
    tolls of what it destroys (`total`; `total_bound` proves it where the two agree), and its status
    is BROKE_THROUGH where it destroys though it could go round. In every mode MAP plans what is
    carried out (PY16 §3.1), and `plan` is that plan: made within the same jitted call, or, for
    chains of obstacles of every length up to 16, when that call is traced.

    Removal costs are added and compared exactly, whatever their ratios; only `removal_cost` and
    `removal_bound` are rounded, down to float32, a sum beyond the greatest float32 to that. So the
    bound is below the true cost of every way, and where both agree, no set of obstacles is cheaper
    by as much as one float32 is apart from the next; where the search was not ended by
    `max_branches`, none is cheaper at all. One task or any batch of them; may be called inside jit,
    vmap and scan; the same bits whatever the batch around a task.

    Args:
      task: from `make_task`, `rasterize` or `stack`; arrays as in `Task`.
      mode: "least", "paper", "literal" or "shortest".
      toll: mode "shortest", the others ignore it: how many cell sides of detour one unit of removal
        cost is worth, finite, not negative; float32 [...] gives each task of a batch its own. Tolls
        are rounded to units of 1/5741 cell side (on larger maps a little coarser:
        `propagation.fixed_point`). Totals from about 370,000 cell sides on cannot be held: such
        a route counts as none.
      max_destroyed: K, the room for obstacles destroyed. It does not change which set is chosen:
        where the least needs more, the status is BUDGET_SPENT and `num_destroyed` says how many,
        though a dearer set of fewer may open a way as well. More than the task has obstacles costs
        nothing but the room in the answer.
      max_cells: N, the room for the route in cells; more needed: BUDGET_SPENT. By default as much
        as any shortest path on a map of this shape can need (three quarters of its cells); give
        less to save memory on large batches of large maps.
      max_branches: modes "least" and "shortest" only: choices of obstacles looked into before the
        best answer so far is returned. In mode "least", where every obstacle is connected by sides
        and no two overlap, one more than must be destroyed is enough; in mode "shortest" they
        follow on the search that remembers what is paid for, which is enough up to 32 obstacles
        that may matter; else more close more gaps between cost and bound.

    Raises:
      TypeError, ValueError: an array of the task has a wrong dtype or shape, or an option is out of
        range.
      TypeError: a gradient of the answer is asked for: `least_removal` and `least_total` have one.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> srt_jax.Status(int(solution.status)).name, solution.cost.item()
      ('SOLVED', 6.0)
      >>> solution.destroyed[: int(solution.num_destroyed)].tolist()
      [0]
    """
    solution = _solve(
        task,
        mode=mode,
        toll=toll,
        max_destroyed=max_destroyed,
        max_cells=max_cells,
        max_branches=max_branches,
    )
    return solution if is_traced(task, toll) else of_task(solution, task)


def solve_in_room(task: Task, **options: Any) -> Solution:
    """`solve` outside jit, but that `cells` has only as much room as the routes of this batch were
    given, and that the arrays are NumPy's.
    """
    return _solve(task, has_all_room=False, **options)


def _solve(
    task: Task,
    *,
    mode: str,
    toll: float | Array,
    max_destroyed: int,
    max_cells: int | None,
    max_branches: int,
    has_all_room: bool = True,
) -> Solution:
    require_task("solve", task)
    batch = task_batch(task)
    if mode not in MODES:
        raise ValueError(f"mode must be one of {', '.join(MODES)}, got {mode!r}")
    if max_destroyed < 1:
        raise ValueError(f"max_destroyed must be at least 1, got {max_destroyed}")
    if max_cells is not None and max_cells < 1:
        raise ValueError(f"max_cells must be at least 1, got {max_cells}")
    if max_branches < 1:
        raise ValueError(f"max_branches must be at least 1, got {max_branches}")
    ranks = Task(labels=3, destroyable=1, removal_cost=1, start=1, goal=1, size=1)
    height, width = task.labels.shape[-2:]
    room = max_cells or _default_room(height, width, mode)
    tolls = toll_of_each(toll, batch, mode)
    if is_traced(task, tolls):
        task = task.replace(removal_cost=refuse_gradient(task.removal_cost, _NO_GRADIENT))
        tolls = refuse_gradient(jnp.asarray(tolls), _NO_GRADIENT)
        flat = jax.tree.map(fold, task, ranks)
        slots = min(max_destroyed, flat.destroyable.shape[1])
        solution = _solver(mode, slots, room, max_branches)(
            flat, jnp.full(len(flat.start), room, jnp.int32), tolls
        )
        solution = with_slots(solution, max_destroyed, jnp)
        return jax.tree.map(lambda array: unfold(array, batch), solution)
    flat = jax.tree.map(eager.fold, task, ranks)

    refuse_fork()

    def run() -> Solution:
        options = {"mode": mode, "max_destroyed": max_destroyed, "max_branches": max_branches}
        solution = _with_room(flat, np.asarray(tolls), room, options)
        if has_all_room:
            return eager.unfold(with_cells(solution, room), batch)
        return jax.tree.map(lambda array: unfold(np.asarray(array), batch), solution)

    return cores.at_device_of(run, *jax.tree.leaves(task))


def _default_room(height: int, width: int, mode: str) -> int:
    """Returns room for any route of modes "least" and "shortest", a shortest path; the legs of the
    paper's loop may add up to more.
    """
    return max_path_cells(height, width) * (1 if mode in ("least", "shortest") else 2)


def _usual_room(height: int, width: int, mode: str) -> int:
    """Returns room for nearly every route, on small maps, where compiling once more would take
    longest, for all but mazes: room for any takes half the time of an answer to fill and to copy.
    """
    return min(_default_room(height, width, mode), max(1024, 4 * max(height, width)))


def _with_room(task: Task, tolls: np.ndarray, most: int, options: dict[str, Any]) -> Solution:
    """Returns the solution with the usual room for the route, and again with more where a route
    needs it, up to `most`.
    """
    room = _usual_room(*map_bucket(*task.labels.shape[2:]), options["mode"])
    capacity = None
    while True:
        solution = _in_buckets(task, tolls, min(room, most), capacity, **options)
        longest = int(np.max(np.asarray(solution.num_cells), initial=0))
        if longest <= room or room >= most:
            return solution
        # In the modes of the paper what stopped for want of room may need more yet.
        room = capacity = min(batch_bucket(longest), most)


def _in_buckets(
    task: Task,
    tolls: np.ndarray,
    room: int,
    capacity: int | None,
    *,
    mode: str,
    max_destroyed: int,
    max_branches: int,
) -> Solution:
    """Returns the solution, computed on arrays padded to bucketed shapes, so that few shapes are
    ever compiled.

    On the host a large batch goes in parts, side by side on all cores (`cores`). `capacity` is what
    is compiled to hold a route of `room` cells; None for what is usual on a map of that shape.
    """
    # The shape of the bucket; how many tasks one part has.
    B, L, H, W = task.labels.shape
    M = task.destroyable.shape[1]
    sides = map_bucket(H, W)

    def room_of(height: int, width: int) -> int:
        if capacity is None:
            return _usual_room(height, width, mode)
        return max(128, batch_bucket(capacity))

    own = Bucket(batch_bucket(B), batch_bucket(L), *sides, obstacle_bucket(M), room_of(*sides))
    # Room for all obstacles where there may be as many destroyed: few sizes are ever compiled.
    slots = max_destroyed if max_destroyed < M else max(8, batch_bucket(M))
    size = (
        cores.part_size(own.batch, H * W * L, cores.SOLVE)
        if cores.is_on_host(*jax.tree.leaves(task))
        else own.batch
    )

    def program(shape: Bucket, is_part: bool = False) -> Callable[[Task, Array, Array], Solution]:
        return _solver(mode, slots, shape.room, max_branches, is_part)

    # A part that fills its bucket needs neither padding nor cutting.
    def run(some: tuple[Task, np.ndarray], shape: Bucket, is_part: bool = False) -> Solution:
        part, own_tolls = some
        solve_in_bucket = program(shape, is_part)
        is_full = part.labels.shape == shape[:4] and part.destroyable.shape[1] == shape.obstacles
        whole = part if is_full else pad_batch(part, shape[:5])
        own_tolls = np.pad(own_tolls, (0, shape.batch - len(own_tolls)))
        solution = solve_in_bucket(whole, np.full(shape.batch, room, np.int32), own_tolls)
        return solution if is_full and shape.room == room else cut(solution, part, room)

    everything = (task, tolls)
    is_cut = size < B
    kind = (mode, slots, max_branches, is_cut, *_settings())
    own = own._replace(batch=min(size, own.batch))
    most = most_of_parts(own, B) if is_cut else MOST
    shape = _shapes.choose(
        kind, own, lambda shape: _is_kept(program(shape, is_cut), shape), room_of, most
    )
    with _shapes.timed(kind, own, shape):
        if is_cut:
            key = program(shape, True), shape, room
            solution = cores.in_parts(
                lambda part: run(part, shape, True), everything, shape.batch, key
            )
        else:
            parts = [run(part, shape) for part in _parts(everything, shape.batch)]
            solution = parts[0] if len(parts) == 1 else jax.tree.map(_joined, *parts)
    return with_slots(solution, max_destroyed, np)


def _settings() -> tuple:
    """What else decides a program: settings of JAX that may change while the process runs."""
    return jax.config.jax_enable_x64, jax.config.jax_default_device  # pyright: ignore


def _parts(some: tuple[Task, np.ndarray], size: int) -> list[tuple[Task, np.ndarray]]:
    """Returns a batch and its tolls in parts of at most `size` tasks."""
    count = len(some[0].start)
    if count <= size:
        return [some]
    cuts = range(0, count, size)
    return [jax.tree.map(lambda array, i=i: array[i : i + size], some) for i in cuts]


def _joined(*arrays: Array) -> np.ndarray:
    return np.concatenate([np.asarray(array) for array in arrays])


def _is_kept(run: Any, shape: Bucket) -> bool:
    """Returns whether the solver's program for batches of this shape is on disk."""
    B, M = shape.batch, shape.obstacles
    task = Task(
        labels=jax.ShapeDtypeStruct(shape[:4], jnp.int32),
        destroyable=jax.ShapeDtypeStruct((B, M), jnp.bool_),
        removal_cost=jax.ShapeDtypeStruct((B, M), jnp.float32),
        start=jax.ShapeDtypeStruct((B, 2), jnp.int32),
        goal=jax.ShapeDtypeStruct((B, 2), jnp.int32),
        size=jax.ShapeDtypeStruct((B, 2), jnp.int32),
    )
    room, toll = (jax.ShapeDtypeStruct((B,), dtype) for dtype in (jnp.int32, jnp.float32))
    return run.is_kept(task, room, toll)


_SHORT_ROUTES = 1024
"""Room for routes on maps of up to 256 x 256: there LLVM's level 2 takes an eighth off the time to
compile, and answers take no longer. On 512 x 512 they would take half as long again.
"""

_SMALL_BATCH, _ONE_MAP = 1 << 17, 1 << 20
"""Labels of a batch of small maps, and of a single map, up to which tasks are answered before their
program is optimised. One map of 64 x 64 takes 0.9 ms then instead of 0.35, one of 512 x 512 with
streets 7 instead of 2.5, and the first answer a third less time.
"""


def _is_small(task: Task, *_: Array) -> bool:
    batch, _, height, width = task.labels.shape
    num_labels = math.prod(task.labels.shape)
    is_small_batch = height * width <= SMALL_MAP and num_labels <= _SMALL_BATCH
    # Among many obstacles an answer would take too long.
    is_one_map = batch == 1 and num_labels <= _ONE_MAP and task.destroyable.shape[1] < MANY
    return (is_small_batch or is_one_map) and not is_measuring()


@functools.cache
def _solver(
    mode: str, max_destroyed: int, capacity: int, max_branches: int, is_part: bool = False
) -> Callable[[Task, Array, Array], Solution]:
    """Returns `answer_batch` with its options, jitted; vmapped, it arrives as one larger batch."""
    names = [field.name for field in dataclasses.fields(Task)]

    @batch_kernel
    def of_arrays(room: Array, toll: Array, *arrays: Array) -> Solution:
        task = Task(**dict(zip(names, arrays)))
        walk = way_of(mode, toll, max_branches)
        return answer_batch(task, room, walk, max_destroyed=max_destroyed, capacity=capacity)

    return jitted(
        lambda task, room, toll: of_arrays(room, toll, *(getattr(task, name) for name in names)),
        is_part=is_part,
        is_large=True,
        level=2 if capacity <= _SHORT_ROUTES else None,
        name=("solve", mode, max_destroyed, capacity, max_branches, is_part),
        in_tiers=None if is_part else _is_small,
    )


def task_batch(task: Task) -> tuple[int, ...]:
    """Returns the batch dimensions of a task; TypeError or ValueError that names the array that
    does not fit the others.
    """
    wanted = {
        "labels": (np.int32, 3),
        "destroyable": (np.bool_, 1),
        "removal_cost": (np.float32, 1),
    }
    wanted |= dict.fromkeys(("start", "goal", "size"), (np.int32, 1))
    require_forms(task, wanted)
    for name, length in (
        ("start", 2),
        ("goal", 2),
        ("size", 2),
        ("removal_cost", task.destroyable.shape[-1]),
    ):
        if getattr(task, name).shape[-1] != length:
            raise ValueError(
                f"task.{name} must have {length} entries, got {list(getattr(task, name).shape)}"
            )
    return common_batch(
        **{name: (getattr(task, name), core_rank) for name, (_, core_rank) in wanted.items()}
    )
