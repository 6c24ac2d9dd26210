"""The maps that the rows of a scenario are on."""

import os
import pathlib
from collections.abc import Sequence

import numpy as np

from srt_jax.formats.movingai import ScenRow, read_map, scaled
from srt_jax.formats.notes import Notes
from srt_jax.formats.shared.start_and_goal import require_free


def scenario_maps(
    path: str, rows: Sequence[tuple[int, ScenRow]], map_path: str | None, notes: Notes
) -> list[np.ndarray]:
    """Returns for each row of a scenario the map, bool [H, W], that it is on; rows on one map share
    it.

    A map of another size than its row names is scaled to that, as the format has it, where the
    sides keep their ratio; where they do not it is another map.

    Args:
      rows: with their numbers, counted from 0.
      map_path: of the map, where it does not lie beside the scenario; where rows name several maps,
        for those rows that name this one.

    Raises:
      ValueError: a map is not there, or a row starts or ends on no free cell.
    """
    folder = pathlib.Path(path).parent
    is_single = len({row.map_name for _, row in rows}) == 1
    maps: dict[tuple[str, int, int], np.ndarray] = {}
    for number, row in rows:
        key = (row.map_name, row.height, row.width)
        if key not in maps:
            is_given = map_path is not None and (
                is_single or pathlib.Path(map_path).name == row.map_name
            )
            where = str(map_path) if is_given else str(folder / row.map_name)
            if not os.path.isfile(where):  # False for names that no file can have
                raise ValueError(
                    f"{path}:{number + 2}: the row is on the map {row.map_name}, and there is no"
                    f" such file as {where}: put the map beside the scenario"
                )
            free = read_map(where, notes=notes)
            _require_scale(f"{path}:{number + 2}", row, where, free)
            maps[key] = scaled(free, row.height, row.width)
            if maps[key].shape != free.shape:
                notes.tell(
                    f"{pathlib.Path(where).name}, {free.shape[1]} wide and {free.shape[0]} high, is"
                    f" scaled to {row.width} x {row.height} cells, as the rows have it"
                )
        for what, cell in (("start", row.start), ("goal", row.goal)):
            require_free(f"{path}:{number + 2}: {what}", maps[key], cell)
    return [maps[row.map_name, row.height, row.width] for _, row in rows]


def _require_scale(where: str, row: ScenRow, map_path: str, free: np.ndarray) -> None:
    """Raises ValueError where a map cannot be the one that a row was made for, at whatever
    scale.
    """
    height, width = free.shape
    away = (
        abs(row.height - height * row.width / width),
        abs(row.width - width * row.height / height),
    )
    if min(away) > 0.5:  # a side is rounded to whole cells
        raise ValueError(
            f"{where}: the row is for a map {row.width} wide and {row.height} high, but {map_path}"
            f" is {width} wide and {height} high, and no scale makes them equal: give the map it"
            " was made for"
        )
