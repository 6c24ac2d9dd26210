"""The agent-centred polar frame: points, sectors, the squares that contain them, and corridors
along a straight link (PY16 §2).

A point is (x, y) in metres, y to the left of x. In the agent's frame it is (r, phi): metres from
the agent, and radians counter-clockwise (leftwards) from its heading, in (-pi, pi]. Every function
takes NumPy arrays (usually float64) or JAX arrays with any batch dimensions, and returns arrays of
the same kind.
"""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.records import Array, record

FULL_TURN = 2 * math.pi


@record
class Sector:
    """The points between two distances and two directions from the agent: a fuzzy area with sharp
    borders.

    near, far: float [...], metres, 0 <= near <= far.
    start: float [...], radians, the direction of the right side, as seen from the agent.
    width: float [...], radians from there leftwards, 0 to a full turn.
    """

    near: Array
    far: Array
    start: Array
    width: Array


def wrap(angle: Array) -> Array:
    """Returns the same directions, float [...], in (-pi, pi]."""
    turned = math.pi - (math.pi - angle) % FULL_TURN
    # The remainder of a tiny negative number is rounded to a full turn, which would be outside the
    # half-open range.
    xp = array_namespace(angle)
    return xp.where(turned <= -math.pi, turned + FULL_TURN, turned)


def to_polar(points: Array, origin: Array, heading: Array) -> Array:
    """Returns points in the agent's frame; (0, 0) for the agent's own position.

    Args:
      points: float [..., 2], (x, y).
      origin: float [..., 2], the position of the agent.
      heading: float [...], where it looks: radians counter-clockwise from the x axis.

    Returns:
      float [..., 2], (r, phi).
    """
    xp = array_namespace(points, origin, heading)
    offset = points - origin
    r = xp.hypot(offset[..., 0], offset[..., 1])
    phi = wrap(xp.arctan2(offset[..., 1], offset[..., 0]) - heading)
    return xp.stack([r, xp.where(r > 0, phi, xp.zeros_like(phi))], axis=-1)


def from_polar(polar: Array, origin: Array, heading: Array) -> Array:
    """Returns points of the agent's frame as (x, y), float [..., 2]: the inverse of `to_polar`."""
    xp = array_namespace(polar, origin, heading)
    r, turn = polar[..., 0], polar[..., 1] + heading
    return origin + xp.stack([r * xp.cos(turn), r * xp.sin(turn)], axis=-1)


def sector_corners(sector: Sector) -> Array:
    """Returns the four pairs (r, phi) that describe a sector: near right, near left, far left, far
    right; float [..., 4, 2].
    """
    xp = array_namespace(sector.near)
    end = wrap(sector.start + sector.width)
    start = wrap(sector.start)
    pairs = ((sector.near, start), (sector.near, end), (sector.far, end), (sector.far, start))
    return xp.stack([xp.stack(pair, axis=-1) for pair in pairs], axis=-2)


def in_sector(polar: Array, sector: Sector) -> Array:
    """Returns which points of the agent's frame lie in the sector, bool [...]; its border belongs
    to it.
    """
    r, phi = polar[..., 0], polar[..., 1]
    is_between = (sector.near <= r) & (r <= sector.far)
    # The agent's own position has every direction.
    return is_between & (
        ((phi - sector.start) % FULL_TURN <= sector.width) | (sector.width >= FULL_TURN) | (r <= 0)
    )


def sector_of_square(centre: Array, side: Array, origin: Array, heading: Array) -> Sector:
    """Returns the smallest sector that contains an axis-aligned square; if the agent is inside the
    square, all directions from 0 m on.

    Args:
      centre: float [..., 2].
      side: float [...], metres.
      origin, heading: of the agent, as in `to_polar`.
    """
    # The distance to the nearest point of the square, 0 from inside.
    xp = array_namespace(centre, side, origin, heading)
    half = side[..., None] / 2
    offset = origin - centre
    nearest = xp.clip(offset, -half, half) - offset
    near = xp.hypot(nearest[..., 0], nearest[..., 1])

    # The corners in the agent's frame.
    turns = xp.concatenate([-half, -half], axis=-1), xp.concatenate([-half, half], axis=-1)
    corners = xp.stack([centre + turn * sign for turn in turns for sign in (1, -1)], axis=-2)
    corners = to_polar(corners, origin[..., None, :], heading[..., None])

    # From outside, a square covers at most a half turn, so every corner lies less than a half turn
    # from the direction of its centre.
    middle = to_polar(centre, origin, heading)[..., 1]
    beside = wrap(corners[..., 1] - middle[..., None])
    is_inside = near == 0
    start = xp.where(is_inside, -math.pi, wrap(middle + beside.min(axis=-1)))
    width = xp.where(is_inside, FULL_TURN, beside.max(axis=-1) - beside.min(axis=-1))
    return Sector(near=near, far=corners[..., 0].max(axis=-1), start=start, width=width)


def sector_of_points(points: Array, is_point: Array, origin: Array, heading: Array) -> Sector:
    """Returns the smallest sector that contains a set of points, such as a contour; all zeros
    without points.

    Its directions are the full turn without the widest gap between neighbouring points; ties go to
    the gap that starts first, counted leftwards from behind the agent. A point at the agent's own
    position has no direction; it only sets `near` to 0.

    Args:
      points: float [..., N, 2], (x, y).
      is_point: bool [..., N], False on padding.
      origin, heading: of the agent, as in `to_polar`.
    """
    # Distances.
    xp = array_namespace(points, origin, heading)
    polar = to_polar(points, origin[..., None, :], heading[..., None])
    r, has_direction = polar[..., 0], is_point & (polar[..., 0] > 0)
    near = xp.where(is_point, r, math.inf).min(axis=-1)
    far = xp.where(is_point, r, 0.0).max(axis=-1)

    # The gap from each direction to the next one leftwards; the last one is followed by the first.
    phi = xp.sort(xp.where(has_direction, polar[..., 1], math.inf), axis=-1)
    first, following = (
        phi[..., :1] + FULL_TURN,
        xp.concatenate([phi[..., 1:], xp.full_like(phi[..., :1], math.inf)], axis=-1),
    )
    is_known = xp.isfinite(phi)
    following = xp.where(xp.isfinite(following), following, first)
    gap = xp.where(is_known, following, 0.0) - xp.where(is_known, phi, 0.0)

    # The sector starts after the widest gap.
    widest = gap.argmax(axis=-1)[..., None]
    start = xp.take_along_axis(xp.where(is_known, following, 0.0), widest, axis=-1)[..., 0]
    width = xp.where(is_known.any(axis=-1), xp.maximum(FULL_TURN - gap.max(axis=-1), 0.0), 0.0)
    return Sector(
        near=xp.where(xp.isfinite(near), near, 0.0), far=far, start=wrap(start), width=width
    )


def square_of_sector(sector: Sector, origin: Array, heading: Array) -> tuple[Array, Array]:
    """Returns the axis-aligned square that contains the sector, centred at its bounding box and as
    wide as the longer side of that box (PY16 Figure 1).

    Args:
      sector: in the agent's frame.
      origin, heading: of the agent, as in `to_polar`.

    Returns:
      centre: float [..., 2], (x, y).
      side: float [...], metres.
    """
    # The bounding box of the corners.
    xp = array_namespace(sector.near, origin, heading)
    corners = from_polar(sector_corners(sector), origin[..., None, :], heading[..., None])
    low, high = corners.min(axis=-2), corners.max(axis=-2)

    def extend(quarter: int, sign: int, border: Array) -> Array:
        """Returns a border of the box, moved to where the far arc crosses that axis if it crosses
        it between the two sides of the sector.
        """
        is_crossed = (quarter * math.pi / 2 - heading - sector.start) % FULL_TURN <= sector.width
        tip = origin[..., quarter % 2] + sign * sector.far
        return xp.where(is_crossed, tip, border)

    high = xp.stack([extend(0, 1, high[..., 0]), extend(1, 1, high[..., 1])], axis=-1)
    low = xp.stack([extend(2, -1, low[..., 0]), extend(3, -1, low[..., 1])], axis=-1)
    return (low + high) / 2, (high - low).max(axis=-1)


def in_square(points: Array, centre: Array, side: Array) -> Array:
    """Returns which points (x, y) lie in the axis-aligned square, bool [...]; its border belongs
    to it.
    """
    return (abs(points - centre) <= side[..., None] / 2).all(axis=-1)


def distance_to_link(points: Array, start: Array, goal: Array) -> Array:
    """Returns the distance of points from the straight link start-goal, in metres, float [...];
    from that point if start and goal are equal.

    Args:
      points, start, goal: float [..., 2], (x, y); batch dimensions broadcast.
    """
    xp = array_namespace(points, start, goal)
    link, offset = goal - start, points - start
    length = (link * link).sum(axis=-1)
    along = (offset * link).sum(axis=-1) / xp.where(length > 0, length, xp.ones_like(length))
    away = offset - xp.clip(along, 0, 1)[..., None] * link
    return xp.hypot(away[..., 0], away[..., 1])


def in_corridor(points: Array, start: Array, goal: Array, deviation: Array) -> Array:
    """Returns which points deviate from the link start-goal by at most `deviation` metres, bool
    [...].
    """
    return distance_to_link(points, start, goal) <= deviation


def path_deviation(path: Array, num_points: Array) -> Array:
    """Returns the greatest distance of a path from the straight link of its ends, in metres; 0 for
    one point or none.

    The distance from a segment is convex, so on each leg of the path it is greatest at an end of
    that leg.

    Args:
      path: float [..., N, 2], (x, y), anything after the last point.
      num_points: int [...].

    Returns:
      float [...].
    """
    xp = array_namespace(path)
    away = distance_to_link(path, path[..., :1, :], _end(path, num_points))
    number = xp.arange(path.shape[-2], dtype=num_points.dtype).reshape(
        (1,) * num_points.ndim + (-1,)
    )
    is_point = number < num_points[..., None]
    return xp.where(is_point, away, xp.zeros_like(away)).max(axis=-1)


def path_link(path: Array, num_points: Array) -> Array:
    """Returns the length of the straight link between the ends of a path, in metres, float [...];
    arguments as in `path_deviation`.
    """
    link = (_end(path, num_points) - path[..., :1, :])[..., 0, :]
    return array_namespace(path).hypot(link[..., 0], link[..., 1])


def _end(path: Array, num_points: Array) -> Array:
    """Returns the last point of each path, float [..., 1, 2]; row 0 if it has no point."""
    xp = array_namespace(path)
    last = xp.clip(num_points - 1, 0, path.shape[-2] - 1)
    return xp.take_along_axis(path, last[..., None, None], axis=-2)


def array_namespace(*arrays: Array) -> Any:
    """Returns jax.numpy if one of the arrays is a JAX array, else numpy."""
    return jnp if any(isinstance(array, jax.Array) for array in arrays) else np
