"""Sizes to which arrays are padded, so that few shapes are compiled."""


def next_power_of_two(count: int, least: int = 1) -> int:
    """Returns the smallest power of two that is at least `count` and `least`, itself one."""
    return max(least, 1 << max(0, count - 1).bit_length())
