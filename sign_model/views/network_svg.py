"""The three semantic networks of a world model as one picture: images, significances, personal
meanings, one below the other (PY16 §3.1).
"""

from collections.abc import Iterable, Sequence

import numpy as np

from sign_model.description import COMPONENT_NAMES, NETWORK_NAMES, kind_of_sign
from sign_model.signs.matrix import Component
from sign_model.signs.network import networks
from sign_model.signs.world_model import WorldModel
from sign_model.views import svg

MOST_SIGNS = 200
"""The most signs that a picture shows."""

_COLOURS = {
    Component.IMAGE: "#1b1b1b",
    Component.SIGNIFICANCE: "#1d4ed8",
    Component.MEANING: "#b91c1c",
}
_ROW, _WIDTH, _GAP, _TOP = 17, 150, 60, 52
_MOST_LETTERS = 24


def draw_networks(model: WorldModel, *, names: Iterable[str] | None = None) -> str:
    """Returns the text of an SVG file with the networks W_p, W_m and W_a: a panel each, which shows
    the signs that have links in it, column by column by their kind, and an arrow for each link.

    Args:
      model: such as `world_model_of(task)`.
      names: the signs to show; by default all.

    Raises:
      ValueError: a name is not the name of a sign, or there are more signs than `MOST_SIGNS`.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> model = sign_model.world_model_of(sign_model.load(domain, problem))
      >>> sign_model.draw_networks(model).count("marker-end")  # links
      21
    """
    shown = [model.index(name) for name in (model.names if names is None else names)]
    if len(shown) > MOST_SIGNS:
        raise ValueError(
            f"a picture of {len(shown)} signs cannot be read: choose at most {MOST_SIGNS} of them"
            " by names="
        )
    links = np.asarray(networks(model.matrices))[:, shown][:, :, shown]
    parts: list[str] = []
    width, height = 0.0, 0.0
    for component in Component:
        panel, panel_width, height = _panel(
            [model.names[i] for i in shown], links[component], component, height
        )
        parts += panel
        width = max(width, panel_width)
    return svg.picture(width, height + 10, "The semantic networks of a world model", parts)


def _panel(
    names: Sequence[str], links: np.ndarray, component: Component, top: float
) -> tuple[list[str], float, float]:
    """Returns the parts of one panel, its width, and where it ends.

    Args:
      names: of the signs.
      links: bool [n, n], (from, to).
      component: which network.
      top: where the panel begins.
    """
    # The signs with links, in columns by kind.
    linked = np.flatnonzero(links.any(axis=0) | links.any(axis=1))
    columns: dict[str, list[int]] = {}
    for i in sorted(linked.tolist(), key=lambda i: (_COLUMNS.index(kind_of_sign(names[i])), i)):
        columns.setdefault(kind_of_sign(names[i]), []).append(i)
    colour = _COLOURS[component]
    count = int(links.sum())
    title = f"{NETWORK_NAMES[component]}: {COMPONENT_NAMES[component]}s, {count} links"
    parts = [svg.text(16, top + 24, title, size=15, colour=colour)]
    boxes, place = [], {}
    for number, (kind, members) in enumerate(columns.items()):
        x = 16 + number * (_WIDTH + _GAP)
        parts.append(svg.text(x, top + 42, kind, size=11, colour=svg.PALE))
        for row, i in enumerate(members):
            y = top + _TOP + row * _ROW
            place[i] = (x, y)
            boxes.append(svg.box(x, y, _WIDTH, _ROW - 3, fill="#f3f4f6", edge="#d1d5db"))
            boxes.append(svg.text(x + 4, y + 11, _short(names[i], kind), size=10))

    # The links, from the side of a box that faces the other one; paler where there are many.
    opacity = round(min(0.7, max(0.15, 40 / max(1, count))), 2)
    for one, other in np.argwhere(links).tolist():
        (x0, y0), (x1, y1) = place[one], place[other]
        begin = x0 + (_WIDTH if x1 > x0 else 0), y0 + _ROW / 2 - 1
        end = x1 + (0 if x1 > x0 else _WIDTH), y1 + _ROW / 2 - 1
        if x0 == x1:
            begin, end = (x0 + _WIDTH, begin[1]), (x1 + _WIDTH, end[1])
        parts.append(svg.curve(begin, end, colour, opacity=opacity))
    parts += boxes  # above the links, so that names can be read
    tallest = max((len(members) for members in columns.values()), default=0)
    width = 32 + len(columns) * (_WIDTH + _GAP)
    return parts, max(width, 320), top + _TOP + tallest * _ROW + 16


_COLUMNS = ("situation", "act", "action", "script", "role", "fact", "predicate", "object", "type")
"""The kinds from left to right: most links lead to the right."""


def _short(name: str, kind: str) -> str:
    words = name.removeprefix(f"{kind} ")
    return words if len(words) <= _MOST_LETTERS else words[: _MOST_LETTERS - 1] + "…"
