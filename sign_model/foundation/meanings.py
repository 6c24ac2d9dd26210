"""Numbers that explain themselves in words; loads nothing but the standard library."""

import enum
from typing import Self


class WithMeaning(enum.IntEnum):
    """Base class of numbers that explain themselves: `NAME = number, "what it means"`."""

    meaning: str

    def __new__(cls, value: int, meaning: str) -> Self:
        member = int.__new__(cls, value)
        member._value_ = value
        member.meaning = meaning
        return member
