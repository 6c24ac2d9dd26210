"""The public names of sign_model."""

import subprocess
import sys

import pytest

import sign_model


def test_every_public_name_can_be_loaded():
    for name in sign_model.__all__:
        assert getattr(sign_model, name) is not None
    assert callable(sign_model.validate) and callable(sign_model.describe)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'fly'"):
        _ = sign_model.fly


def test_planning_one_task_does_not_load_jax():
    code = (
        "import sys, sign_model; sign_model.load, sign_model.plan, sign_model.validate;"
        " sys.exit('jax' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
