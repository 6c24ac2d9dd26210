"""Three agents in the centre of Helsinki, none of whom can do without another.

    python docs/examples/helsinki_coalition.py [FILE.png]

Agent 0 wants to cross the city, which a wall cuts in two. Agent 1 can destroy the wall, but is shut
in by a ring. Agent 2 can destroy the ring, and the one round the goal. Map data: (c) OpenStreetMap
contributors, ODbL 1.0.
"""

import sys

import numpy as np

from srt_jax.coalition import (
    check_coalition,
    explain_coalition,
    make_coalition,
    solve_coalition,
)
from srt_jax.data import helsinki
from srt_jax.draw.coalition import draw_coalition
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.instances.paper_blockers import block, pick_start_goal

SIDE = 250


def task():
    """Returns the task; the buildings are one obstacle that nobody can destroy."""
    place = helsinki()
    covered = cover(place.obstacles, square_grid(place.bounds, SIDE))
    buildings = (covered >= 0).any(axis=0)
    labels = np.where(buildings, 0, -1).astype(np.int32)[None]
    first, goal = pick_start_goal(~buildings, apart=180, seed=4)
    ends = [tuple(cell) for cell in np.argwhere(~buildings).tolist()]
    labels, wall = block(labels, first, goal, "half")
    labels, ring_of_goal = block(labels, first, goal, "bagel-30")
    # the helpers stand on the first agent's side of the wall
    near = [c for c in ends if abs(c[0] - first[0]) + abs(c[1] - first[1]) in range(50, 90)]
    for shut_in in near:
        try:
            ringed, ring = block(labels, first, shut_in, "bagel-30")
        except ValueError:  # no room for a ring there
            continue
        break
    helper = next(c for c in near if (ringed[:, c[0], c[1]] == -1).all() and c[0] > shut_in[0] + 30)
    return make_coalition(
        ringed,
        [first, shut_in, helper],
        [goal, None, None],
        able=[(), (wall,), (ring, ring_of_goal)],
    )


def main() -> None:
    coalition = task()
    solution = solve_coalition(coalition)
    assert check_coalition(coalition, solution) == []
    print(explain_coalition(coalition, solution))
    if sys.argv[1:]:
        draw_coalition(coalition, solution, sys.argv[1], title="Helsinki: three agents")


if __name__ == "__main__":
    main()
