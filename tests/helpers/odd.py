"""Files damaged in every way a disk or an editor has: what a reader makes of them must be a map
or one ValueError.
"""

import numpy as np


def damaged(content: bytes, *, seed: int, count: int = 40):
    """Yields copies of a file that are cut short, have bytes changed, or stretches doubled or
    taken out.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        first, last = np.sort(rng.integers(0, len(content) + 1, 2)).tolist()
        kind = rng.integers(4)
        if kind == 0:
            yield content[:first]
        elif kind == 1:
            changed = bytearray(content)
            for place in rng.integers(0, len(content), rng.integers(1, 6)).tolist():
                changed[place] = int(rng.integers(256))
            yield bytes(changed)
        elif kind == 2:
            yield content[:last] + content[first:]
        else:
            yield content[:first] + content[last:]


def refusals(read, path, content: bytes, *, seed: int = 0, count: int = 40) -> int:
    """Reads damaged copies of a file; returns how many were refused. Anything but a ValueError
    of one line gets through.
    """
    refused = 0
    for broken in damaged(content, seed=seed, count=count):
        path.write_bytes(broken)
        try:
            read(path)
        except ValueError as error:
            refused += 1
            assert str(path) in str(error) and "\n" not in str(error).strip()
    return refused
