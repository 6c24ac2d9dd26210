"""To which sizes an eager call pads its maps and its batch, so that few shapes are compiled."""

from sign_model.foundation.sizes import next_power_of_two

_SIZES = (8, 16, 32, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 1536, 2048, 3072, 4096)

SMALL_MAP = 1 << 14
"""Cells of a map up to which a program may be compiled without LLVM's optimisation at first."""


def size_bucket(length: int) -> int:
    """Returns the side to which a map's side is padded, so that few shapes are compiled."""
    for size in _SIZES:
        if length <= size:
            return size
    return -(-length // 1024) * 1024


def map_bucket(height: int, width: int) -> tuple[int, int]:
    """Returns the sides to which a map is padded where compiling is expensive: small maps share
    squares.
    """
    side = max(32, size_bucket(max(height, width)))
    return (
        (side, side)
        if side <= 128
        else (max(128, size_bucket(height)), max(128, size_bucket(width)))
    )


def batch_bucket(count: int) -> int:
    """Returns the batch size to which `count` is padded: the next power of two."""
    return next_power_of_two(count)


def obstacle_bucket(count: int) -> int:
    """Returns the number of obstacles to which `count` is padded: up to 128 cost a solver nothing
    that can be measured.
    """
    return max(128, batch_bucket(count))
