"""What docs/learning.md says is what runs."""

import pathlib
import re

import jax
import pytest

PAGE = (pathlib.Path(__file__).resolve().parents[2] / "docs" / "learning.md").read_text()


@pytest.mark.parametrize("example", re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL))
def test_the_examples_run_as_written(example):
    for name in re.findall(r"^import (\w+)", example, flags=re.MULTILINE):
        pytest.importorskip(name)  # torch, grain and Gymnasium are no part of the core
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        exec(example, {})
