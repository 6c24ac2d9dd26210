"""Maps drawn as pictures."""

import numpy as np

from srt_jax import make_task


def drawn(picture: str) -> tuple[np.ndarray, dict[str, tuple[int, int]]]:
    """Reads a map from a picture: '@' is blocked, all else free; returns free [H, W] and where each
    letter stands.
    """
    rows = [line.strip() for line in picture.strip().splitlines()]
    free = np.array([[sign != "@" for sign in row] for row in rows])
    places = {
        sign: (r, c) for r, row in enumerate(rows) for c, sign in enumerate(row) if sign not in ".@"
    }
    return free, places


def task_from(picture, **options):
    """A task from a picture: S, G, '.' free, '@' the indestructible obstacle, letters destroyable
    obstacles by name.
    """
    free, places = drawn(picture)
    rows = [line.strip() for line in picture.strip().splitlines()]
    names = sorted({sign for row in rows for sign in row} - set(".@SG"))
    labels = np.array(
        [[names.index(sign) if sign in names else -1 for sign in row] for row in rows], np.int32
    )
    labels[~free] = len(names)
    destroyable = np.arange(len(names) + 1) < len(names)
    return make_task(labels, places["S"], places["G"], destroyable=destroyable, **options), names
