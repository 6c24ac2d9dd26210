"""Pictures of tasks and their solutions: single maps, contact sheets, animations. Needs matplotlib
(which brings Pillow).

A picture shows the map, the obstacles by whether they can be destroyed, what is reached before
anything is, the seed, the contour, the route with a colour per leg, and what is destroyed, numbered
in order. Colour-blind people can tell the colours apart.
"""

from sign_model.foundation.submodules import named_when_asked
from srt_jax.draw.animation import animate
from srt_jax.draw.connection import draw_connection
from srt_jax.draw.parts.polar_frame import PolarFrame
from srt_jax.draw.parts.tile import svg_tile
from srt_jax.draw.picture import draw
from srt_jax.draw.plots import bound_against_cost, boxes_by_kind, time_against_size
from srt_jax.draw.sheet import contact_sheet
from srt_jax.draw.tradeoffs import draw_tradeoffs

__all__ = [
    "PolarFrame",
    "animate",
    "bound_against_cost",
    "boxes_by_kind",
    "contact_sheet",
    "draw",
    "draw_connection",
    "draw_tradeoffs",
    "svg_tile",
    "time_against_size",
]

__getattr__, __dir__ = named_when_asked(__name__)
