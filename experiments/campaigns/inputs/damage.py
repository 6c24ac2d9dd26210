"""Files damaged at random, and the same way for the same seed."""

import io
import zipfile

import numpy as np

_PIECES = [
    *(
        b"[",
        b"{",
        b"(",
        b"<",
        b"]",
        b"}",
        b")",
        b'"',
        b"\0",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"\x1b[31m",
        b"\r",
        b" " * 99,
    ),
    *(
        b"1e400",
        b"-1",
        b"NaN",
        b"null",
        b"true",
        b"9" * 30,
        b"1" * 400,
        b"7" * 5000,
        b"-0.0",
        b"1e-400",
        b"\xed\xb2\x80",
    ),
    *(
        b"[" * 3000,
        b"(" * 3000,
        b"<a>" * 3000,
        b"99999999",
        b"{}",
        b"[]",
        b"*a",
        b"&a [*a]",
        b"/dev/zero",
        b"../",
    ),
]


def mutate(content: bytes, *, seed: int | tuple[int, ...]) -> bytes:
    """Returns the bytes damaged in one to four places; the same seed damages them in the same
    way.
    """
    rng = np.random.default_rng(seed)
    if content.startswith(b"PK") and rng.random() < 0.6:
        return _repack(content, rng)
    damaged = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        _damage(damaged, rng)
    return bytes(damaged)


def _damage(content: bytearray, rng: np.random.Generator) -> None:
    at, length = int(rng.integers(0, len(content) + 1)), int(rng.integers(1, 20))
    match rng.integers(0, 7):
        case 0:
            content[at : at + 1] = bytes([int(rng.integers(0, 256))])
        case 1:
            del content[at : at + length]
        case 2:
            content[at:at] = content[at : at + 10 * length]
        case 3:
            del content[at:]
        case 4:
            content[at : at + length] = content[
                (other := int(rng.integers(0, len(content) + 1))) : other + length
            ]
        case _:
            content[at : at + int(rng.integers(0, 3))] = _PIECES[int(rng.integers(len(_PIECES)))]


def _repack(content: bytes, rng: np.random.Generator) -> bytes:
    """Returns a whole archive in which one member is damaged, missing or there twice."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: bytearray(archive.read(name)) for name in archive.namelist()}
    chosen = sorted(members)[int(rng.integers(len(members)))]
    if rng.random() < 0.1:
        del members[chosen]
    else:
        _damage(members[chosen], rng)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, member in members.items():
            archive.writestr(zipfile.ZipInfo(name), bytes(member))
    return file.getvalue()
