"""Files are read under a limit, and the limit itself takes no memory."""

import pytest

from sign_model.foundation import files


def test_a_limit_far_beyond_the_memory_costs_nothing(tmp_path):
    path = tmp_path / "small.bin"
    path.write_bytes(b"abc")
    assert files.read_bytes(path, most=1 << 50) == b"abc"


def test_a_file_is_read_in_parts_and_no_further_than_its_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_PART", 4)
    path = tmp_path / "ten.bin"
    path.write_bytes(b"0123456789")
    assert files.read_bytes(path, most=10) == b"0123456789"
    with pytest.raises(files.FileError, match=r"ten\.bin"):
        files.read_bytes(path, most=9)


def test_an_empty_file_is_read(tmp_path):
    path = tmp_path / "empty.bin"
    path.write_bytes(b"")
    assert files.read_bytes(path) == b""
