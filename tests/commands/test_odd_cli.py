"""What breaks command lines: odd names and outputs, crashes, interrupts, and files that declare
more than they hold.
"""

import errno
import io
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import numpy as np
import pytest

from experiments.campaigns.readers import SEEDS, Outcome, mutate, read_one
from sign_model.foundation import files as ground
from sign_model.foundation.legible import legible
from srt_jax import cli
from srt_jax.cli import run
from srt_jax.commands.shared import interrupts
from srt_jax.commands.shared.reporting import exit_code
from srt_jax.draw.gallery import file_names
from srt_jax.formats import gridmap
from srt_jax.formats.batch import write_batch
from srt_jax.formats.shared.whole_files import atomic_write, draft_of, read_bytes
from srt_jax.formats.task_files import read_prepared, read_tasks
from srt_jax.task import make_task, stack

ROOT = pathlib.Path(__file__).resolve().parents[2]
ODD = ROOT / "tests" / "odd_inputs" / "cli"
ENDS = ("--start", "0,0", "--goal", "0,4")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(ODD / "base.map", tmp_path)
    return tmp_path


def printed(capsys, *arguments):
    code = run([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return code, out, err


def program(*arguments, **options):
    """Starts the command line as a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | options.pop("env", {})
    environment = {name: value for name, value in environment.items() if value is not None}
    command = [sys.executable, "-m", "srt_jax", *arguments]
    return subprocess.Popen(command, env=environment, text=True, stderr=subprocess.PIPE, **options)


# Odd inputs, each with its right result.


@pytest.mark.parametrize("name", ["big_endian.npz", "bracket_name.npz", "long_name.npz"])
def test_batches_of_other_byte_orders_and_names_are_solved(here, capsys, name):
    code, out, err = printed(capsys, "solve", ODD / name, "--json", "--out", "answers")
    assert (code, err, json.loads(out)["tasks"][0]["status"]) == (0, "", "SOLVED")
    pictures = [path.name for path in (here / "answers").iterdir() if path.suffix == ".png"]
    assert len(pictures) == 1 and len(pictures[0]) < 150


def test_square_brackets_of_a_name_are_shown(here, capsys):
    code, out, _ = printed(capsys, "solve", ODD / "bracket_name.npz")
    assert code == 0 and "run [/7]" in out


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("break_declared_shape.npz", "cut off"),
        ("break_zip_version.npz", "zip file version"),
        ("break_endless_picture.yaml", "/dev/zero: the picture of the map"),
        (
            "break_long_integer.geojson",
            "coordinates must be finite: one is infinite, or has so many digits",
        ),
        ("break_long_height.map", "break_long_height.map:2: the height"),
        ("nosuch.map", "nosuch.map: no such file"),
    ],
)
def test_what_declares_too_much_is_refused_in_one_line(here, capsys, name, message):
    ends = ENDS if name == "break_long_height.map" else ()
    code, out, err = printed(capsys, "solve", ODD / name, *ends)
    assert (
        (code, out, err.count("\n")) == (2, "", 1) and message in err and "object at 0x" not in err
    )


@pytest.mark.parametrize("command", [["solve"], ["draw"], ["convert"], ["scen"], ["plan"]])
@pytest.mark.parametrize("form", ["missing", "pipe", "pipe of arrays", "device", "folder"])
def test_only_regular_files_are_read_by_any_command(here, capsys, command, form):
    name = {
        "missing": "none.map",
        "pipe": "pipe.map",
        "pipe of arrays": "pipe.npz",
        "device": "/dev/zero",
        "folder": "folder.map",
    }[form]
    if form.startswith("pipe"):
        os.mkfifo(here / name)
    if form == "folder":
        (here / name).mkdir()
    other = {"convert": ["out.map"], "plan": ["problem.pddl"]}.get(command[0], [])
    code, out, err = printed(capsys, *command, name, *other)
    assert (code, out, err.count("\n")) == (2, "", 1) and name in err
    assert {
        "missing": "no such file",
        "pipe": "a pipe",
        "pipe of arrays": "a pipe",
        "device": "a device",
        "folder": "a folder",
    }[form] in err


# Reading within limits.


def npz_of(path, **members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)


def test_arrays_that_unpack_to_more_than_the_limit_are_refused_before_they_do(here, monkeypatch):
    monkeypatch.setattr("srt_jax.formats.containers.arrays.MOST_BYTES", 1000)
    monkeypatch.setattr(
        "srt_jax.formats.containers.arrays.read_arrays.__kwdefaults__", {"most": 1000}
    )
    head = io.BytesIO()
    np.save(head, np.zeros((1, 1, 40, 40), np.int32))
    npz_of(here / "bomb.npz", labels=head.getvalue())
    with pytest.raises(
        ValueError,
        match=r"bomb.npz: its arrays take 6528 bytes unpacked, and at most 1000 are read",
    ):
        read_tasks("bomb.npz")


def test_an_array_shorter_than_its_header_says_is_cut_off(here):
    head = io.BytesIO()
    np.save(head, np.zeros((1, 1, 4, 4), np.int32))
    npz_of(here / "short.npz", labels=head.getvalue()[:-4])
    with pytest.raises(
        ValueError, match=r"declares shape \[1, 1, 4, 4\] and 64 bytes, but 60 are there"
    ):
        read_tasks("short.npz")


def test_a_file_larger_than_the_limit_is_refused_with_the_limit(here):
    (here / "large.bin").write_bytes(bytes(100))
    with pytest.raises(
        ValueError, match=r"large\.bin: the thing has 100 bytes or more, and at most 99 are read"
    ):
        read_bytes(here / "large.bin", "thing", most=99)
    assert len(read_bytes(here / "large.bin", "thing", most=100)) == 100


def test_maps_and_pictures_of_too_many_cells_are_refused_by_their_header(here, capsys, monkeypatch):
    (here / "huge.map").write_text("type octile\nheight 99999999\nwidth 99999999\nmap\n.\n")
    (here / "huge.pgm").write_bytes(b"P5\n99999 99999\n255\n")
    (here / "huge.xml").write_text(
        "<root><map><height>99999</height><width>99999</width><grid/></map></root>"
    )
    for name in ("huge.map", "huge.pgm", "huge.xml"):
        code, _, err = printed(capsys, "solve", name, *ENDS)
        assert code == 2 and err.count("\n") == 1 and name in err and str(gridmap.MOST_CELLS) in err


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("deep.json", "[" * 100_000),
        ("deep.geojson", '{"type": "GeometryCollection", "geometries": [' * 400 + "]}" * 400),
        ("deep.yaml", "image: " + "[" * 5000),
        (
            "laughs.yaml",
            "a: &a [1, 1]\nb: &b [*a, *a]\nimage: x.png\nresolution: 1\norigin: [*b, *b, *b]\n",
        ),
        ("digits.json", '{"format": "srt-jax world", "version": ' + "1" * 5000 + "}"),
        ("digits.xml", f"<root><map><height>{'1' * 5000}</height><width>1</width></map></root>"),
    ],
)
def test_deep_nesting_and_endless_numbers_are_refused_in_one_line(here, capsys, name, content):
    (here / name).write_text(content)
    code, out, err = printed(capsys, "solve", name)
    *notes, error = err.splitlines()  # what was noted before the reading ended comes first
    assert (code, out) == (2, "") and all(line.startswith("srt-jax: note: ") for line in notes)
    assert error.startswith("srt-jax: error: ") and name in error and len(err) < 900


# Whole files, whatever happens.


def test_nothing_is_left_of_a_file_whose_writing_fails_or_is_interrupted(here):
    (here / "a.txt").write_text("old")
    for error in (
        ValueError("x"),
        OSError(errno.ENOSPC, "No space left on device"),
        interrupts.Stopped(),
        KeyboardInterrupt(),
    ):
        with pytest.raises((type(error), ValueError)), atomic_write("a.txt") as file:
            file.write("new")
            raise error
        assert (
            sorted(os.listdir()) == ["a.txt", "base.map"] and (here / "a.txt").read_text() == "old"
        )


def test_a_full_disk_and_a_missing_folder_have_their_own_remedies(here):
    with (
        pytest.raises(ValueError, match=r"a\.txt: cannot be written: full; make room on the disk"),
        atomic_write("a.txt"),
    ):
        raise OSError(errno.ENOSPC, "full")
    with (
        pytest.raises(FileNotFoundError, match="name a file in a folder that exists"),
        atomic_write("none/a.txt"),
    ):
        pass
    with pytest.raises(ValueError, match="it is a device"), atomic_write("/dev/null"):
        pass
    with pytest.raises(ValueError, match="give a shorter name"), atomic_write("x" * 300):
        pass


def test_a_name_as_long_as_the_file_system_permits_is_written(here):
    with atomic_write("x" * 255) as file:
        file.write("\udc80")
    assert (here / ("x" * 255)).read_text() == "\\udc80"


def test_a_link_stays_a_link_and_open_drafts_can_be_removed(here):
    os.symlink("base.map", "link.map")
    with atomic_write("link.map") as file:
        file.write("new")
    assert os.path.islink("link.map") and (here / "base.map").read_text() == "new"
    with pytest.raises(ValueError), draft_of("b.txt") as draft:
        draft.write_text("half")
        ground.remove_open_drafts()
        assert not draft.exists()
    assert not (here / "b.txt").exists()


# Names.


@pytest.mark.parametrize(
    ("text", "encoding", "right"),
    [
        ("run [/7] :smile:", None, "run [/7] :smile:"),
        ("a\x1b[31mred", None, "a\\x1b[31mred"),
        ("a\nb\tc\r\x07", None, "a b c \\x07"),
        ("\udc80", None, "?"),
        ("Дом", "cp1252", "???"),
        ("Дом", "utf-8", "Дом"),
        ("a\u202eb", None, "a\\u202eb"),
    ],
)
def test_names_are_made_legible(text, encoding, right):
    assert legible(text, encoding) == right


ODD_NAMES = [
    "run [/7]",
    "a\x1b[31mred",
    "$\\frac{1$",
    "\udc80",
    "Дом",
    "x" * 3000,
    "x" * 3000 + "y",
    "../../etc",
]


def test_odd_names_are_drawn_listed_and_written_and_never_leave_the_folder(here, capsys):
    task = make_task(np.array([[[-1, 0, -1]]]), (0, 0), (0, 2))
    write_batch("names.npz", stack([task] * len(ODD_NAMES)), names=ODD_NAMES)
    code, out, _ = printed(capsys, "solve", "names.npz", "--out", "a", "--report", "p.html")
    assert code == 0 and "\x1b" not in out and "run [/7]" in out
    assert len(os.listdir("a")) == len(ODD_NAMES) + 2  # a picture each, the sheet, the results
    assert [
        task["name"] for task in json.loads((here / "a" / "results.json").read_text())["tasks"]
    ] == ODD_NAMES
    assert sorted(os.listdir()) == ["a", "base.map", "names.npz", "p.html"]


def test_file_names_are_short_and_unique():
    names = file_names(["x" * 3000, "x" * 3000, "x" * 2999, "Д" * 200, "a", "a", "a-2"])
    assert len(set(names)) == len(names) and max(len(name.encode()) for name in names) < 130


# Exit codes.


def test_one_means_that_a_task_cannot_be_solved_and_nothing_else():
    def code(*statuses):
        return exit_code([{"status": status} for status in statuses])

    assert code("SOLVED", "PATH_EXISTS") == 0
    assert code("SOLVED", "BUDGET_SPENT") == 3
    assert code("BUDGET_SPENT", "UNSOLVABLE") == code("START_BLOCKED") == 1


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (MemoryError(), 70, "out of memory"),
        (RecursionError("maximum recursion depth"), 70, "internal error: RecursionError"),
        (OverflowError("too large"), 70, "internal error: OverflowError"),
        (NotImplementedError(), 70, "internal error: NotImplementedError"),
        (AssertionError("a solution failed its replay\nmore"), 70, "a solution failed its replay"),
        (
            RuntimeError("RESOURCE_EXHAUSTED: Out of memory allocating 1 bytes\nstack"),
            70,
            "out of memory",
        ),
        (OSError(errno.EACCES, "Permission denied", "x.map"), 70, "x.map: Permission denied"),
        (TypeError("unexpected"), 70, "please report it"),
        (ValueError("this rule"), 2, "this rule"),
        (BrokenPipeError(errno.EPIPE, "Broken pipe"), 141, ""),
        (KeyboardInterrupt(), 130, "interrupted"),
        (interrupts.Stopped(), 130, "interrupted"),
    ],
)
def test_whatever_goes_wrong_is_one_line_with_its_own_code(
    here, capfd, monkeypatch, error, code, message
):
    def fails(*arguments, **options):
        raise error

    monkeypatch.setattr(interrupts._State, "is_reported", False)
    monkeypatch.setattr("srt_jax.commands.shared.reading_options.read_prepared", fails)
    assert run(["solve", "base.map", *ENDS]) == code
    out, err = capfd.readouterr()
    assert (
        out == ""
        and err.count("\n") == (1 if message else 0)
        and message in err
        and "Traceback" not in err
    )
    if code == 70:
        assert run(["solve", "base.map", *ENDS, "--debug"]) == code
        assert "Traceback" in capfd.readouterr().err
        monkeypatch.setenv("SRT_JAX_DEBUG", "1")
        assert run(["solve", "base.map", *ENDS]) == code
        assert "Traceback" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ValueError("bad.map:2: wrong"), "error: bad.map:2: wrong"),
        (OSError(errno.EIO, "Input/output error"), "bad.map: cannot be read: Input/output error"),
        (MemoryError(), "bad.map: out of memory"),
        (RecursionError("too deep"), "bad.map: cannot be read: too deep"),
        (OverflowError("too large"), "bad.map: cannot be read: too large"),
    ],
)
@pytest.mark.parametrize("command", ["solve", "draw"])
def test_one_bad_file_does_not_stop_the_others(here, capsys, monkeypatch, command, error, message):
    def read(path, *options):
        if path == "bad.map":
            raise error
        return read_prepared(path, *options)

    monkeypatch.setattr("srt_jax.commands.shared.reading_options.read_prepared", read)
    code, out, err = printed(capsys, command, "bad.map", "base.map", *ENDS, "--json")
    assert (code, err.count("\n")) == (2, 1) and message in err
    assert len(json.loads(out)["tasks"]) == 1


def test_debug_is_taken_anywhere_but_after_two_dashes():
    assert cli._without_flags(["--debug", "solve", "a"]) == (["solve", "a"], {"--debug"})
    assert cli._without_flags(["solve", "a", "--quiet"]) == (["solve", "a"], {"--quiet"})
    assert cli._without_flags(["solve", "--", "--debug"]) == (["solve", "--", "--debug"], set())


@pytest.mark.parametrize("kind", ["full", "closed by its reader", "closed"])
def test_files_are_whole_whatever_becomes_of_standard_output(here, kind):
    if kind == "full" and not os.path.exists("/dev/full"):
        pytest.skip("no /dev/full here")
    arguments = ("solve", "base.map", *ENDS, "--results", "r.json")
    environment = {"PYTHONUNBUFFERED": "1"}
    if kind == "full":
        with open("/dev/full", "w") as out:
            process = program(*arguments, stdout=out, env=environment)
    elif kind == "closed":  # and without a home folder, in the same start
        environment |= {"HOME": "", "XDG_CACHE_HOME": "", "JAX_COMPILATION_CACHE_DIR": None}
        process = program(*arguments, preexec_fn=lambda: os.close(1), env=environment)
    else:
        process = program(*arguments, stdout=subprocess.PIPE, env=environment)
        process.stdout.close()
    err = process.stderr.read()
    code = process.wait(timeout=300)
    assert code == {"full": 70, "closed by its reader": 141, "closed": 0}[kind]
    assert "Traceback" not in err and err.count("\n") == (1 if kind == "full" else 0)
    assert json.loads((here / "r.json").read_text())["tasks"][0]["status"] == "SOLVED"


def test_a_missing_device_is_an_error_in_one_line(here):
    environment = {"JAX_PLATFORMS": "nonesuch"}
    process = program("solve", "base.map", *ENDS, stdout=subprocess.PIPE, env=environment)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 70 and err.count("\n") == 1 and "Traceback" not in err


@pytest.mark.parametrize("rows", ["9" * 5000 + ":", "\u00b2:", "x:", "-1:", "1"])
def test_rows_that_are_no_numbers_are_refused_by_the_name_of_their_option(here, capsys, rows):
    code, out, err = printed(capsys, "solve", "base.map", f"--rows={rows}")
    assert (code, out, err.count("\n")) == (2, "", 1) and len(err) < 250
    assert "--rows must be two numbers A:B" in err


# Interrupts.


@pytest.mark.parametrize(
    ("number", "moment"), [(signal.SIGTERM, "importing"), (signal.SIGINT, "working")]
)
def test_a_signal_ends_the_program_with_one_line_and_no_draft(here, number, moment):
    process = program(
        "dataset",
        "rooms",
        "--count",
        "4000",
        "--size",
        "32",
        "--out",
        "rooms",
        stdout=subprocess.PIPE,
    )
    deadline = time.monotonic() + 120
    if moment == "working":
        while not (here / "rooms" / "dataset.json").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
    else:
        while not is_watched(process.pid) and time.monotonic() < deadline:
            time.sleep(0.01)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number and out == "" and err.count("\n") == 1
    assert ("interrupted" if number == signal.SIGINT else "terminated") in err
    assert not list(here.rglob("*.part"))


def is_watched(pid):
    """Whether the process has its handlers: the bit of SIGINT in the mask of signals that are
    caught, and that of SIGTERM.
    """
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
    except OSError:
        pytest.skip("no /proc here")
    caught = int(
        next(line for line in status.splitlines() if line.startswith("SigCgt")).split()[1], 16
    )
    return caught >> (signal.SIGTERM - 1) & 1


@pytest.mark.parametrize(
    ("how", "number"),
    [
        ("swallowed", signal.SIGINT),
        ("in a callback of the collector", signal.SIGINT),
        ("compiled code", signal.SIGINT),
        ("in a callback of the collector", signal.SIGTERM),
    ],
)
def test_a_signal_that_is_swallowed_ends_the_program_all_the_same(tmp_path, how, number):
    """By SIGTERM: also a shell's background job, for which Ctrl-C is not."""
    body = {
        "swallowed": [
            "while time.monotonic() < end:",
            "    try: time.sleep(0.05)",
            "    except BaseException: pass",
        ],
        "in a callback of the collector": [
            "import gc",
            "gc.callbacks.append(lambda phase, info: time.sleep(0.2))",
            "while time.monotonic() < end: gc.collect()",
        ],
        "compiled code": [
            "import ctypes",
            "ctypes.CDLL(None).sleep(20) or ctypes.CDLL(None).sleep(20)",
        ],
    }[how]
    module = str(ROOT / "srt_jax" / "commands" / "shared" / "interrupts.py")
    script = tmp_path / "srt-jax"  # the name of the installed program
    lines = [
        "import sys, time",
        "import importlib.util",
        f"spec = importlib.util.spec_from_file_location('interrupts', {module!r})",
        "interrupts = importlib.util.module_from_spec(spec)",
        "spec.loader.exec_module(interrupts)",
        "interrupts.GRACE = 0.5",
        "interrupts.begin_work()",
        "print('ready', flush=True)",
        "end = time.monotonic() + 30",
        "try:",
        *(f"    {line}" for line in body),
        "except interrupts.Stopped:",
        "    sys.exit(interrupts.report_stop())",
    ]
    script.write_text("\n".join(lines) + "\n")
    own = signal.getsignal(signal.SIGINT)
    if number == signal.SIGTERM:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # which the process inherits
    try:
        process = subprocess.Popen(
            [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
    finally:
        signal.signal(signal.SIGINT, own)
    assert process.stdout.readline() == "ready\n"
    if number == signal.SIGTERM:
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
    process.send_signal(number)
    _, err = process.communicate(timeout=20)
    word = "interrupted" if number == signal.SIGINT else "terminated"
    assert process.returncode == 128 + number and err.count("\n") == 1 and word in err


@pytest.mark.parametrize("when", ["while a module is imported", "when all is printed"])
def test_no_signal_unwinds_an_import_or_kills_the_end(tmp_path, when):
    """Extension modules in C++ abort the process where an exception meets them (exit code 134);
    the interpreter's last steps have no handler any more.
    """
    (tmp_path / "slow_module.py").write_text(
        "import time\nprint('ready', flush=True)\n"
        "try: time.sleep(30)\n"
        "except BaseException: print('unwound', flush=True)\n"
    )
    module = str(ROOT / "srt_jax" / "commands" / "shared" / "interrupts.py")
    lines = [
        "import importlib.util, os, sys",
        f"spec = importlib.util.spec_from_file_location('interrupts', {module!r})",
        "interrupts = importlib.util.module_from_spec(spec)",
        "spec.loader.exec_module(interrupts)",
        "interrupts.begin_work()",
        *(
            ["import slow_module"]
            if when == "while a module is imported"
            else [
                "import time",
                "class Last:",
                "    def __del__(self, write=os.write, sleep=time.sleep):",
                "        write(1, b'ready\\n')",
                "        sleep(1)",
                "sys.last = Last()",
            ]
        ),
    ]
    script = tmp_path / "srt-jax"
    script.write_text("\n".join(lines) + "\n")
    process = subprocess.Popen(
        [sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    if when == "while a module is imported":
        assert (process.returncode, out) == (130, "")
        assert err.count("\n") == 1 and "interrupted" in err
    else:
        assert (process.returncode, out, err) == (0, "", "")


def test_as_a_library_no_handler_is_installed():
    code = (
        "import signal, srt_jax; print(signal.getsignal(signal.SIGINT) is"
        " signal.default_int_handler)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert done.stdout == "True\n"


# Mutated files.


@pytest.mark.parametrize("name", SEEDS)
def test_the_files_that_are_mutated_are_right(tmp_path, name):
    (tmp_path / name).write_bytes(SEEDS[name]())
    assert read_one(tmp_path / name) == (Outcome.READ, "")


@pytest.mark.parametrize("name", SEEDS)
def test_mutated_files_are_read_or_refused_in_one_sentence(tmp_path, name):
    for number in range(6):
        path = tmp_path / name
        path.write_bytes(mutate(SEEDS[name](), seed=number))
        outcome, message = read_one(path)
        assert outcome in (Outcome.READ, Outcome.REFUSED), message
        assert "\n" not in message and "object at 0x" not in message
