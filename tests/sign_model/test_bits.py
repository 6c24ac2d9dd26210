"""Rows of bits as words and as whole numbers."""

import numpy as np
import pytest

from sign_model.bits import NumberedRows, as_number, as_words, pack, unpack


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
