"""A place to set tasks in: polygons in metres, without a start or a goal."""

import dataclasses

from srt_jax.geometry.projection import Projection
from srt_jax.geometry.world import Obstacle, as_bounds


@dataclasses.dataclass(frozen=True)
class Place:
    """A place to set tasks in.

    bounds: (x_min, y_min, x_max, y_max), metres, x to the east and y to the north; obstacles may
      reach across.
    obstacles: in the order of their ids, with their names where they have one.
    attribution: to be shown beside whatever is made from it; "" where nothing is required.
    projection: from its metres to longitude and latitude, where that is known.
    """

    bounds: tuple[float, float, float, float]
    obstacles: tuple[Obstacle, ...]
    attribution: str = ""
    projection: Projection | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "bounds", as_bounds(self.bounds))
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
