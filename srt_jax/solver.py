"""The whole task: the path where there is one; else what blocks, what to destroy, and the route
that does it.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.ground.marks import jitted
from srt_jax.engine import cores, eager
from srt_jax.engine.arguments import common_batch, fold, is_traced, require_forms, unfold
from srt_jax.engine.batching import batch_kernel
from srt_jax.engine.buckets import batch_bucket, map_bucket, obstacle_bucket
from srt_jax.engine.forks import refuse_fork
from srt_jax.engine.no_gradient import refuse_gradient
from srt_jax.engine.packing import unpack
from srt_jax.engine.reuse import Bucket, Shapes
from srt_jax.moves import max_path_cells
from srt_jax.obstacles import holds, opens_at
from srt_jax.padding import cut, pad_batch, with_cells, with_slots
from srt_jax.removal.branch_and_bound import search_least
from srt_jax.removal.paper_loop import Symbolic, greedy_walk
from srt_jax.removal.prices import goal_prices
from srt_jax.removal.proof import blockages, covering
from srt_jax.removal.route import NEVER, Route, in_order
from srt_jax.removal.sums import totals
from srt_jax.symbols.acts import left_behind, place_plan
from srt_jax.symbols.planning import ATTENDED, first_act, plan_along_chain, plan_on_contour
from srt_jax.tolls.least_total import least_total
from srt_jax.tolls.options import toll_of_each
from srt_jax.types import Array, Solution, Status, Task

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
      toll: mode "shortest" only: how many cell sides of detour one unit of removal cost is worth,
        finite, not negative; float32 [...] gives each task of a batch its own. Tolls are rounded to
        units of 1/5741 cell side (on larger maps a little coarser: `fields.fixed_point`). Totals
        from about 370,000 cell sides on cannot be held: such a route counts as none.
      max_destroyed: K, the room for obstacles destroyed. It does not change which set is chosen:
        where the least needs more, the status is BUDGET_SPENT and `num_destroyed` says how many,
        though a dearer set of fewer may open a way as well. More than the task has obstacles costs
        nothing but the room in the answer.
      max_cells: N, the room for the route in cells; more needed: BUDGET_SPENT. By default as much
        as any shortest path on a map of this shape can need (three quarters of its cells); give
        less to save memory on large batches of large maps.
      max_branches: modes "least" and "shortest" only: choices of obstacles looked into before the
        best answer so far is returned. In mode "least", where every obstacle is connected by sides
        and no two overlap, one more than must be destroyed is enough; in mode "shortest" one is
        enough where every obstacle is a rectangle and no two overlap; else more close more gaps
        between cost and bound.

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
    return _solve(
        task,
        mode=mode,
        toll=toll,
        max_destroyed=max_destroyed,
        max_cells=max_cells,
        max_branches=max_branches,
    )


def solve_in_room(task: Task, **options: Any) -> Solution:
    """`solve` outside jit, but that `cells` has only as much room as the routes of this batch were
    given.
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
        solution = _with_room(flat, np.asarray(tolls), max_cells, room, options)
        return eager.unfold(with_cells(solution, room) if has_all_room else solution, batch)

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


def _with_room(
    task: Task, tolls: np.ndarray, max_cells: int | None, most: int, options: dict[str, Any]
) -> Solution:
    """Returns the solution with the usual room for the route, and again with more where a route
    needs it, up to `most`; with `max_cells`, with just that.
    """
    if max_cells is not None:
        return _in_buckets(task, tolls, most, most, **options)
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
    if size < B:
        part_shape = own._replace(batch=size)
        solution = cores.in_parts(
            lambda part: run(part, part_shape, True), everything, size, (program(own, True), room)
        )
    else:
        kind = (mode, slots, max_branches, *_settings())
        shape = _shapes.choose(kind, own, lambda shape: _is_kept(program(shape), shape), room_of)
        with _shapes.timed(kind, own, shape):
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


@functools.cache
def _solver(
    mode: str, max_destroyed: int, capacity: int, max_branches: int, is_part: bool = False
) -> Callable[[Task, Array, Array], Solution]:
    """Returns `_solve_batch` with its options, jitted; vmapped, it arrives as one larger batch."""
    names = [field.name for field in dataclasses.fields(Task)]

    def walk_by(toll: Array) -> Callable[..., tuple[Array, Array, Way]]:
        if mode == "least":
            return functools.partial(_least, max_branches=max_branches)
        if mode == "shortest":
            return functools.partial(_shortest, toll=toll, max_branches=max_branches)
        return functools.partial(_paper, is_literal=mode == "literal")

    @batch_kernel
    def of_arrays(room: Array, toll: Array, *arrays: Array) -> Solution:
        task = Task(**dict(zip(names, arrays)))
        options = {"max_destroyed": max_destroyed, "capacity": capacity}
        return _solve_batch(task, room, walk_by(toll), **options)

    return jitted(
        lambda task, room, toll: of_arrays(room, toll, *(getattr(task, name) for name in names)),
        is_part=is_part,
        is_large=True,
        name=("solve", mode, max_destroyed, capacity, max_branches, is_part),
    )


def _solve_batch(
    task: Task,
    room: Array,
    walk: Callable[..., tuple[Array, Array, "Way"]],
    *,
    max_destroyed: int,
    capacity: int,
) -> Solution:
    """`solve` for one leading batch axis, every stage natively batched; of the `capacity` for cells
    a route may use `room`.
    """
    # The way, for all tasks whose ends may be joined at all.
    starts = opens_at(task.labels, task.start, jnp.zeros_like(task.destroyable))
    can_end = opens_at(task.labels, task.goal, task.destroyable)
    reached, bound, way = walk(
        task, starts & can_end, room, max_destroyed=max_destroyed, capacity=capacity
    )
    # What blocks at first; where nothing helps, the proof.
    is_open, is_solvable = jax.vmap(holds)(reached, task.goal), jnp.isfinite(bound)
    is_cut_off = starts & ~is_open
    is_inside, is_apart = is_cut_off & ~can_end, is_cut_off & can_end & ~is_solvable
    first, separating = blockages(
        task, reached, is_cut_off=is_cut_off, is_inside=is_inside, is_apart=is_apart
    )
    # What fits into the answer, and the status.
    has_route = way.is_there & (way.num_destroyed <= max_destroyed) & (way.num_cells <= room)
    status = jnp.full(starts.shape, Status.SOLVED, jnp.int32)
    for applies, value in (  # the first that applies, so it is set last
        (is_open, Status.PATH_EXISTS),
        (is_open & (way.num_destroyed > 0), Status.BROKE_THROUGH),
        (~has_route, Status.BUDGET_SPENT),
        (way.is_stuck, Status.STOPPED_SHORT),
        (is_apart, Status.UNSOLVABLE),
        (is_inside, Status.GOAL_BLOCKED),
        (~starts, Status.START_BLOCKED),
    ):
        status = jnp.where(applies, jnp.int32(value), status)
    # A route or a set that does not fit is not returned, but its true number is.
    is_too_long = way.num_cells > room
    are_too_many = way.is_there & (way.num_destroyed > max_destroyed) & ~is_too_long
    return Solution(
        status=status,
        cost=jnp.where(has_route, way.cost, jnp.inf),
        cells=jnp.where(has_route[:, None, None], way.cells, -1),
        num_cells=jnp.where(has_route | is_too_long, way.num_cells, 0),
        destroyed=jnp.where(has_route[:, None], way.destroyed, -1),
        num_destroyed=jnp.where(has_route | are_too_many, way.num_destroyed, 0),
        destroyed_at=jnp.where(has_route[:, None], way.destroyed_at, -1),
        removal_cost=jnp.where(has_route, way.removal_cost, jnp.inf),
        removal_bound=bound,
        total=jnp.where(has_route | (way.total == 0), way.total, jnp.inf),
        total_bound=way.total_bound,
        seed=first.seed,
        contour=unpack(first.contour, task.labels.shape[3]),
        blocking=_as_ids(first.on_contour),
        plan=jnp.where(has_route[:, None, None], way.plan, -1),
        plan_at=jnp.where(has_route[:, None], way.plan_at, -1),
        separating=_as_ids(separating | covering(task, is_inside)),
    )


class Way(NamedTuple):
    """A route, what is destroyed on it and the plan, as in `Solution`; meaningful where `is_there`.

    `num_destroyed` and `num_cells` are the true numbers, which may exceed the room for them.
    `is_stuck`: the symbolic level found no plan, though there is one.
    """

    cells: Array
    num_cells: Array
    cost: Array
    removal_cost: Array
    destroyed: Array
    destroyed_at: Array
    num_destroyed: Array
    plan: Array
    plan_at: Array
    is_there: Array
    is_stuck: Array
    total: Array
    total_bound: Array


def _least(
    task: Task, among: Array, room: Array, *, max_destroyed: int, capacity: int, max_branches: int
) -> tuple[Array, Array, Way]:
    """The cells reached, the bound, and the way of least removal: the shortest route, and MAP's
    plan over what must go.
    """
    found = search_least(task, room, among, capacity=capacity, max_nodes=max_branches)
    way = _way_of_chain(task, found.route, found.cost, found.needed, max_destroyed=max_destroyed)
    return found.reached, found.bound, way


def _way_of_chain(
    task: Task, path: Route, cost: Array, needed: Array, *, max_destroyed: int
) -> Way:
    """The way along a route from which obstacles are destroyed where it needs them gone, `needed`
    as in `Removal`, with MAP's plan; no totals.
    """
    destroyed, at, num_destroyed = in_order(needed, max_destroyed=max_destroyed)
    is_here = (task.start == task.goal).all(axis=1)
    acts = plan_along_chain(num_destroyed, is_here, num_slots=max_destroyed)
    left_at = left_behind(task.labels, path.cells, path.num_cells, destroyed, at)
    plan, plan_at = place_plan(acts.act, acts.slot, path.num_cells, destroyed, at, left_at)
    is_there, never = path.num_cells > 0, jnp.zeros_like(is_here)
    nothing = jnp.zeros_like(path.cost)
    return Way(
        *path,
        cost,
        destroyed,
        at,
        num_destroyed,
        plan,
        plan_at,
        is_there,
        is_stuck=never,
        total=nothing,
        total_bound=nothing,
    )


def _shortest(
    task: Task,
    among: Array,
    room: Array,
    *,
    toll: Array,
    max_destroyed: int,
    capacity: int,
    max_branches: int,
) -> tuple[Array, Array, Way]:
    """The least total of length and tolls; the bound on removals is the price of the goal."""
    reached, bound = goal_prices(task, among)
    among = among & jnp.isfinite(bound)
    found = least_total(task, toll, room, among, capacity=capacity, max_nodes=max_branches)
    cost = totals(task.removal_cost, found.needed < NEVER)
    cost = jnp.where(found.route.num_cells > 0, cost, jnp.inf)
    way = _way_of_chain(task, found.route, cost, found.needed, max_destroyed=max_destroyed)
    return reached, bound, way._replace(total=found.total, total_bound=found.bound)


def _paper(
    task: Task, among: Array, room: Array, *, max_destroyed: int, capacity: int, is_literal: bool
) -> tuple[Array, Array, Way]:
    """The greedy loop, run only where some way can be opened."""
    reached, bound = goal_prices(task, among)
    symbolic = Symbolic(first_act(), plan_on_contour, ATTENDED, is_literal)
    walk = greedy_walk(
        task, jnp.isfinite(bound), room, symbolic, max_destroyed=max_destroyed, capacity=capacity
    )
    cost = _total_cost(task, walk.destroyed)
    own = ("removal_cost", "total", "total_bound")
    fields = {field: getattr(walk, field) for field in Way._fields if field not in own}
    nothing = jnp.zeros_like(cost)
    way = Way(removal_cost=cost, total=nothing, total_bound=nothing, **fields)
    return reached, bound, way


def _total_cost(task: Task, ids: Array) -> Array:
    """Returns the removal costs of `ids` (int32 [B, K], -1 none) added up, rounded down: float32
    [B].
    """
    return totals(jnp.take_along_axis(task.removal_cost, ids.clip(0), axis=1), ids >= 0)


def _as_ids(mask: Array) -> Array:
    """Returns the indices that are True, ascending, then -1: bool [B, M] -> int32 [B, M]."""
    M = mask.shape[1]
    ids = jnp.sort(jnp.where(mask, jnp.arange(M, dtype=jnp.int32)[None], M), axis=1)
    return jnp.where(ids < M, ids, -1)


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
