"""Rows of bits as words and as whole numbers."""

import numpy as np
import pytest

from sign_model import bits
from sign_model.bits import (
    NumberedRows,
    UnionOfRows,
    as_bytes,
    as_number,
    as_words,
    pack,
    popcount,
    unpack,
)


@pytest.mark.parametrize("size", [0, 1, 63, 64, 65, 200])
def test_a_row_survives_the_way_to_a_whole_number_and_back(size: int) -> None:
    row = np.random.default_rng(size).random(size) < 0.5
    number = as_number(pack(row))
    assert number == sum(1 << i for i in range(size) if row[i])
    assert np.array_equal(unpack(as_words(number, size), size), row)


def test_numbered_rows_give_the_row_of_every_matrix() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.random((2, 5, 70)) < 0.3
    rows = NumberedRows(one, other)
    for row in (3, 0, 3):
        assert rows.of(row) == (as_number(pack(one[row])), as_number(pack(other[row])))


@pytest.mark.parametrize("size", [0, 1, 63, 64, 65, 200])
@pytest.mark.parametrize("has_instruction", [True, False])
def test_bits_are_counted_with_and_without_an_instruction_for_it(
    size: int, has_instruction: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not has_instruction:
        monkeypatch.delattr(np, "bitwise_count", raising=False)
    rows = np.random.default_rng(size).random((9, size)) < 0.5
    assert popcount(pack(rows)).tolist() == rows.sum(axis=1).tolist()


def test_equal_rows_alone_have_equal_bytes() -> None:
    rows = np.random.default_rng(0).random((60, 4)) < 0.5
    keys = as_bytes(pack(rows))
    for row, key in zip(rows, keys):
        assert [other == key for other in keys] == (rows == row).all(axis=1).tolist()


@pytest.mark.parametrize("size, width", [(1, 1), (7, 3), (8, 64), (9, 65), (30, 200)])
@pytest.mark.parametrize("most", [0, 1 << 19])
def test_the_union_of_named_rows_is_the_or_of_each(
    size: int, width: int, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bits, "_MOST_CHOICES", most)
    rng = np.random.default_rng(size)
    rows = rng.random((size, width)) < 0.1
    union = UnionOfRows(pack(rows))
    for _ in range(6):  # the first are few, so they are looked up one by one
        sets = rng.random((50, size)) < 0.3
        expected = [rows[chosen].any(axis=0) for chosen in sets]
        assert np.array_equal(unpack(union.of(sets), width), expected)
    assert (union.choices is None) == (most == 0)
