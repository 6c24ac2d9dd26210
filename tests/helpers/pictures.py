"""Maps drawn as pictures."""

import numpy as np


def drawn(picture: str) -> tuple[np.ndarray, dict[str, tuple[int, int]]]:
    """Reads a map from a picture: '@' is blocked, all else free; returns free [H, W] and where
    each letter stands.
    """
    rows = [line.strip() for line in picture.strip().splitlines()]
    free = np.array([[sign != "@" for sign in row] for row in rows])
    places = {
        sign: (r, c) for r, row in enumerate(rows) for c, sign in enumerate(row) if sign not in ".@"
    }
    return free, places
