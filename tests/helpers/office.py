"""A floor of rooms along a corridor as a map of ROS, with doors, some of them shut, and a picture
that names those.
"""

import numpy as np

from srt_jax.formats.gridmap import GridMap
from srt_jax.formats.ros_map import write_ros_map

SIDE, CORNER = 0.05, (-10.0, -9.6)


def write_office(folder, *, height=384, width=400, yaw=0.0) -> np.ndarray:
    """Writes office.yaml, its picture, and doors.png; returns the map, bool [H, W].

    The two doors of the goal's and the start's room are shut; each is 0.9 m wide.
    """
    from PIL import Image

    rng = np.random.default_rng(7)
    free = np.zeros((height, width), bool)
    unknown = np.ones((height, width), bool)
    margin, thick, door, half = 20, 3, 18, height // 8
    free[margin:-margin, margin:-margin] = True
    unknown[margin:-margin, margin:-margin] = False
    # walls around, along the corridor, and between the rooms
    for row in (margin, height // 2 - half, height // 2 + half, height - margin - thick):
        free[row : row + thick, margin:-margin] = False
    upper, lower = slice(margin, height // 2 - half), slice(height // 2 + half, height - margin)
    for col in (margin, width // 2, width - margin - thick):
        for rows in (upper, lower):
            free[rows, col : col + thick] = False
    free[margin:-margin, [margin, -margin - 1]] = False
    named = np.full((height, width, 3), 255, np.uint8)
    colours = iter([(255, 0, 0), (0, 0, 255)])
    for row in (height // 2 - half, height // 2 + half):
        for col in (margin + 12, width - margin - 12 - door):
            doorway = slice(row, row + thick), slice(col, col + door)
            is_shut = (row < height // 2) == (col < width // 2)
            free[doorway] = not is_shut
            if is_shut:
                named[doorway] = next(colours)
    # furniture, away from the corridor and the corners where the ends lie
    for _ in range(30 if min(height, width) > 200 else 0):
        row, col = rng.integers(margin + 30, [height - margin - 60, width - margin - 60])
        if not height // 2 - 2 * half < row < height // 2 + 2 * half:
            tall, wide = rng.integers(3, 12, 2)
            free[row : row + tall, col : col + wide] = False
    write_ros_map(
        folder / "office.yaml",
        GridMap(free, unknown & ~free, SIDE, CORNER, yaw=yaw, has_metres=True),
    )
    Image.fromarray(named).save(folder / "doors.png")
    return free
