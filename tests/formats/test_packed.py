"""Packed files are unpacked once, piece by piece, and only up to a limit."""

import bz2
import gzip
import os

import pytest

from srt_jax.formats.containers import packed
from srt_jax.formats.osm import read_osm


@pytest.fixture
def small_limits(monkeypatch):
    monkeypatch.setattr(packed, "ALWAYS", 1 << 16)
    monkeypatch.setattr(packed, "_CHUNK", 1 << 12)


@pytest.mark.parametrize(
    ("name", "pack"), [("a", bytes), ("a.gz", gzip.compress), ("a.BZ2", bz2.compress)]
)
def test_the_pieces_are_the_content_of_the_file(tmp_path, small_limits, name, pack):
    content = os.urandom(1 << 17)  # above the limit that holds whatever the ratio
    (tmp_path / name).write_bytes(pack(content))
    pieces = list(packed.unpack(tmp_path / name))
    assert len(pieces) > 1 and b"".join(pieces) == content


def test_no_piece_beyond_the_limit_is_handed_out(tmp_path, small_limits):
    (tmp_path / "bomb.osm.gz").write_bytes(gzip.compress(bytes(1 << 22)))
    taken = 0
    with pytest.raises(packed.UnpacksTooFarError, match=r"bomb\.osm\.gz: it unpacks to more than"):
        for piece in packed.unpack(tmp_path / "bomb.osm.gz"):
            taken += len(piece)
    size = (tmp_path / "bomb.osm.gz").stat().st_size
    assert taken == packed.MOST_RATIO * size // 4096 * 4096 and 1 << 16 < taken < 1 << 22


def test_a_large_file_that_is_not_packed_has_no_limit(tmp_path, small_limits, monkeypatch):
    monkeypatch.setattr(packed, "MOST_RATIO", 0)
    (tmp_path / "large").write_bytes(bytes(1 << 17))
    assert sum(map(len, packed.unpack(tmp_path / "large"))) == 1 << 17


@pytest.mark.parametrize(("ending", "pack"), [("gz", gzip.compress), ("bz2", bz2.compress)])
def test_an_extract_is_unpacked_once_and_only_up_to_the_limit(
    tmp_path, small_limits, monkeypatch, ending, pack
):
    opened = []
    real = packed._OPENERS[f".{ending}"]
    monkeypatch.setitem(
        packed._OPENERS, f".{ending}", lambda *args: opened.append(args) or real(*args)
    )
    path = tmp_path / f"bomb.osm.{ending}"
    path.write_bytes(pack(b"<osm version='0.6'>" + b" " * (1 << 21)))
    with pytest.raises(ValueError, match=r"it unpacks to more than .* unpack it and see"):
        read_osm(path)
    assert len(opened) == 1
