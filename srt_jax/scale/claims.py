"""Claims: who is at work on which unit of a folder that several processes and machines share.

Every process that works in a folder has a file there that says who it is, `.claims/*.owner`. A
claim is a hard link to it under the unit's name: it appears at once with its content, and only one
of several that try can make it, on NFS too. While a process lives it touches its file every BEAT
seconds, and so all of its claims.

A claim is dead where its process is: on the same machine that is asked of the system; from another
machine it is concluded after STALE seconds without a touch, by the clock of the folder, which is
the same for all. A survivor does not remove a dead claim, for another might have taken it over in
between: it makes the claim of the next generation. The greatest generation is in force.

Where a file system has no hard links, a claim is a file of its own that is made exclusively.
"""

import contextlib
import errno
import json
import os
import pathlib
import socket
import threading
from typing import Any, NamedTuple

from sign_model.foundation.files import forget_draft, keep_draft
from srt_jax.formats.shared.whole_files import FileError

FOLDER = ".claims"
BEAT = 10.0
STALE = 120.0
_ENDING, _OWNER = ".claim", ".owner"
_NO_LINKS = {errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EXDEV}


class Holder(NamedTuple):
    """Who made a claim. token: of the process. machine: tells machines of one name apart, and the
    rooms of containers. began: when the process was started, as the system counts; tells processes
    of one number apart. seconds: since the last touch, by the folder's clock.
    """

    host: str
    machine: str
    pid: int
    began: str
    token: str
    seconds: float


class Claims:
    """The claims of this process in one folder."""

    def __init__(
        self, folder: pathlib.Path, *, stale: float | None = None, beat: float | None = None
    ) -> None:
        """Args:
        stale, beat: seconds, STALE and BEAT by default; the variables SRT_JAX_STALE and
          SRT_JAX_BEAT set them for a process.
        """
        self.folder = pathlib.Path(folder) / FOLDER
        self._stale = _seconds("SRT_JAX_STALE", STALE) if stale is None else stale
        self._beat = _seconds("SRT_JAX_BEAT", BEAT) if beat is None else beat
        self._me = {
            "host": socket.gethostname(),
            "machine": _machine(),
            "pid": os.getpid(),
            "began": _began(os.getpid()),
            "token": os.urandom(8).hex(),
        }
        self._file = self.folder / f"{self._me['host']}-{os.getpid()}-{self._me['token']}{_OWNER}"
        self._held: dict[str, pathlib.Path] = {}
        self._lock = threading.RLock()
        self._ended = threading.Event()
        self._settle_in()
        threading.Thread(target=self._keep_touching, name="srt-jax-claims", daemon=True).start()

    def take(self, name: str) -> bool:
        """Claims a unit; False where a process that lives holds it, or another was quicker."""
        with self._lock:
            if name in self._held:
                return False
            generation, holder = self.highest(name)
            if holder is not None and not self.is_dead(holder):
                return False
            mine = self.folder / f"{name}.{generation + 1}{_ENDING}"
            if not self._make(mine):
                return False
            self._held[name] = mine
            if self._is_contested(name, generation, holder):
                self.release(name)
                return False
            self._remove_below(name, generation + 1)
            return True

    def release(self, name: str) -> None:
        """Gives a unit back, whether it is done or not."""
        with self._lock:
            mine = self._held.pop(name, None)
            if mine is not None:
                _unlink(mine)

    def holds_any(self) -> bool:
        """Returns whether this process is at work on a unit."""
        return bool(self._held)

    def close(self, *, is_all_done: bool = False) -> None:
        """Ends this process's part: its files go, those of dead processes too, and where all is
        done the folder of claims.
        """
        with self._lock:
            self._ended.set()
            for name in list(self._held):
                self.release(name)
            _unlink(self._file)
            for path in self._listed():
                if is_all_done or (path.suffix == _OWNER and self._is_left_behind(path)):
                    _unlink(path)
            with contextlib.suppress(OSError):
                self.folder.rmdir()

    def highest(self, name: str) -> tuple[int, Holder | None]:
        """Returns the generation of the claim in force and its holder; -1 and None where there is
        none.
        """
        return max(
            (
                (generation, holder)
                for unit, generation, path in self._claims()
                if unit == name and (holder := self._read(path)) is not None
            ),
            key=lambda pair: pair[0],
            default=(-1, None),
        )

    def holders(self) -> dict[str, Holder]:
        """Returns who holds each claimed unit, the dead included."""
        return {
            name: holder
            for name in {unit for unit, _, _ in self._claims()}
            if (holder := self.highest(name)[1]) is not None
        }

    def is_dead(self, holder: Holder) -> bool:
        """Returns whether a claim's process is gone: see the module's docstring."""
        if holder.token == self._me["token"]:
            return False
        if (holder.host, holder.machine) == (self._me["host"], self._me["machine"]):
            return _began(holder.pid) != holder.began
        return holder.seconds > self._stale

    # How a claim is made and read.

    def _settle_in(self) -> None:
        keep_draft(self._file)
        for attempt in range(3):
            try:
                self.folder.mkdir(exist_ok=True)
                self._file.write_text(json.dumps(self._me), encoding="utf-8")
                return
            except OSError as error:
                # whoever was last to finish removes the folder, between these two lines too
                if attempt < 2 and isinstance(error, FileNotFoundError):
                    continue
                raise FileError(
                    f"{self.folder}: no claim can be made in it: {error.strerror}: name a folder in"
                    " which you may write"
                ) from error

    def _make(self, path: pathlib.Path) -> bool:
        keep_draft(path)
        for _ in range(3):
            try:
                os.link(self._file, path)
                return True
            except FileExistsError:
                # an answer that was lost on the network: the link is there, and ours
                if self._is_mine(path):
                    return True
                break
            except FileNotFoundError:  # whoever was last to finish removed the folder
                self._settle_in()
            except OSError as error:
                if error.errno not in _NO_LINKS:
                    raise FileError(f"{path}: cannot be claimed: {error.strerror}") from error
                if self._make_alone(path):
                    return True
                break
        forget_draft(path)
        return False

    def _make_alone(self, path: pathlib.Path) -> bool:
        try:
            with open(path, "x", encoding="utf-8") as file:
                json.dump(self._me, file)
        except FileExistsError:
            return False
        return True

    def _is_mine(self, path: pathlib.Path) -> bool:
        holder = self._read(path)
        return holder is not None and holder.token == self._me["token"]

    def _is_contested(self, name: str, generation: int, judged: Holder | None) -> bool:
        """Whether somebody has come in between: made a greater generation, or, below ours, a claim
        that lives.
        """
        for unit, other, path in self._claims():
            if unit != name or other == generation + 1:
                continue
            if other > generation:
                return True
            holder = self._read(path)
            is_same = judged is not None and holder is not None and holder.token == judged.token
            if holder is not None and not is_same and not self.is_dead(holder):
                return True
        return False

    def _remove_below(self, name: str, generation: int) -> None:
        for unit, other, path in self._claims():
            if unit == name and other < generation:
                _unlink(path)

    def _read(self, path: pathlib.Path) -> Holder | None:
        """Returns the holder of a claim; None where it is gone. One whose content is not there yet
        is judged by its age alone.
        """
        try:
            with open(path, encoding="utf-8") as file:  # opened, so that NFS asks the server
                text, touched = file.read(), os.fstat(file.fileno()).st_mtime
        except OSError:
            return None
        try:
            known: dict[str, Any] = json.loads(text)
            fields = [known[name] for name in ("host", "machine", "pid", "began", "token")]
        except (ValueError, KeyError, TypeError):
            fields = ["", "", 0, "", ""]
        return Holder(*fields, seconds=self.now() - touched)

    def now(self) -> float:
        """Returns the time by the folder's clock: that of the machine that keeps its files."""
        with contextlib.suppress(OSError):
            os.utime(self._file)
            with open(self._file, "rb") as file:
                return os.fstat(file.fileno()).st_mtime
        return 0.0  # then nothing is old, and nobody dead

    def _keep_touching(self) -> None:
        while not self._ended.wait(self._beat):
            for path in (self._file, *list(self._held.values())):
                with contextlib.suppress(OSError):
                    os.utime(path)

    def _listed(self) -> list[pathlib.Path]:
        try:
            return [self.folder / name for name in os.listdir(self.folder)]
        except OSError:
            return []

    def _claims(self) -> list[tuple[str, int, pathlib.Path]]:
        """Returns (unit, generation, file) of every claim."""
        found = []
        for path in self._listed():
            unit, _, generation = path.name.removesuffix(_ENDING).rpartition(".")
            if path.name.endswith(_ENDING) and generation.isdecimal():
                found.append((unit, int(generation), path))
        return found

    def _is_left_behind(self, path: pathlib.Path) -> bool:
        holder = self._read(path)
        return holder is not None and self.is_dead(holder)


_of_folder: dict[tuple[str, int], Claims] = {}
"""The claims of this process; by its number, too, for a fork is another process."""


def claims_of(folder: pathlib.Path) -> Claims:
    """Returns the claims of this process in a folder, the same each time."""
    key = os.path.realpath(folder), os.getpid()
    if key not in _of_folder:
        _of_folder[key] = Claims(folder)
    return _of_folder[key]


def close_claims(folder: pathlib.Path, *, is_all_done: bool = False) -> None:
    """Closes the claims of this process in a folder, unless another of its threads holds one."""
    claims = claims_of(folder)
    if not claims.holds_any():
        _of_folder.pop((os.path.realpath(folder), os.getpid()), None)
        claims.close(is_all_done=is_all_done)


def _seconds(variable: str, default: float) -> float:
    text = os.environ.get(variable, "")
    try:
        return float(text) if text else default
    except ValueError:
        raise ValueError(f"{variable} must be a number of seconds, got {text!r}") from None


def _machine() -> str:
    """Returns what tells two machines of one name apart, and two rooms of processes on one."""
    parts = []
    with contextlib.suppress(OSError):
        parts.append(pathlib.Path("/proc/sys/kernel/random/boot_id").read_text().strip())
    with contextlib.suppress(OSError):
        parts.append(os.readlink("/proc/self/ns/pid"))
    return " ".join(parts)


def _began(pid: int) -> str:
    """Returns when a process of this machine was started; "" where there is none, or it has
    ended and only waits for its parent to notice.
    """
    try:
        # after the name, which may hold anything: the state, and 19 fields on the start
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return "" if fields[0] in "ZX" else fields[19]
    except FileNotFoundError:
        if os.path.isdir("/proc/self"):
            return ""
    except (OSError, IndexError):
        pass
    try:  # a system without /proc
        os.kill(pid, 0)
    except ProcessLookupError:
        return ""
    except OSError:
        pass
    return "lives"


def _unlink(path: pathlib.Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()
    forget_draft(path)
