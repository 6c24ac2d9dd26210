"""A place to set tasks in: polygons in metres, without a start or a goal."""

import dataclasses
import importlib

from sign_model.foundation.legible import counted
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

    def __repr__(self) -> str:
        """What it is in a line; `obstacles` holds the outlines."""
        x_min, y_min, x_max, y_max = self.bounds
        num, gone = len(self.obstacles), sum(one.destroyable for one in self.obstacles)
        whose = f", {self.attribution!r}" if self.attribution else ""
        return (
            f"Place({x_max - x_min:g} x {y_max - y_min:g} m, {counted(num, 'obstacle')},"
            f" {gone} of them destroyable{whose})"
        )

    def _repr_html_(self) -> str:
        """A picture, for notebooks: made far above this module, and loaded only there."""
        return importlib.import_module("srt_jax.draw.notebook").place_html(self)
