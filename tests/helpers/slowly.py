"""Cases of a test that run only with `-m slow`: the like of others, or long to compile."""

from typing import Any

import pytest


def slow(*values: Any) -> list:
    """Returns the values as marked cases for `pytest.mark.parametrize`."""
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]
