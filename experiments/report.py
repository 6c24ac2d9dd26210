"""Writes docs/results.md: runs the experiments and measurements one after the other, and puts what
they found on one page.

Every number on the page stands under the command that made it, with the machine and the versions.
The full runs take about 20 minutes on 2 idle cores, --quick five; each run and the whole tell how
long they took. A run that fails leaves the section of an older one, and the page says so. Longer
campaigns are commands of their own (experiments.campaigns.solver).

examples:
  python -m experiments.report
  python -m experiments.report --only figure3 figure2
  python -m experiments.report --no-run                          the page alone, from what lies in
  results/
"""

import argparse
import json
import pathlib
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import Any

from experiments.figures.outcome import Table, as_markdown, run
from srt_jax.bench.machine import machine_line
from srt_jax.formats.shared.whole_files import atomic_write, make_folder

MINUTES = {
    "figure3": 1.0,
    "figure2": 5.5,
    "figure1": 0.5,
    "solve": 1.0,
    "plan": 1.0,
    "learning": 0.5,
    "envs": 1.5,
    "kernels": 6.5,
    "gradients": 1.0,
}
"""What is run, in the order of the page, and about how long each takes on 2 idle cores."""

EXPERIMENTS = ("figure3", "figure2", "figure1")

TITLES = {
    "figure3": "Figure 3: path planning with blocking-obstacle detection",
    "figure2": "Figure 2: behaviour planning on the blocks world",
    "figure1": "Figure 1, end to end; the paper's loop beside the least removal",
    "solve": "Whole answers",
    "plan": "Planning",
    "learning": "What training loops wait for",
    "envs": "Environments beside others'",
    "kernels": "Kernels",
    "gradients": "Gradients of least costs",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs what is requested and writes the page; exit code 1 where a run failed, whose older
    result then stays.
    """
    parser = argparse.ArgumentParser(
        prog="python -m experiments.report",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--page",
        type=pathlib.Path,
        default=pathlib.Path("docs/results.md"),
        help="default: %(default)s",
    )
    parser.add_argument(
        "--results",
        type=pathlib.Path,
        default=pathlib.Path("results"),
        metavar="DIR",
        help="what the runs leave",
    )
    parser.add_argument(
        "--only",
        nargs="+",
        choices=list(MINUTES),
        default=list(MINUTES),
        metavar="NAME",
        help="run these only",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the experiments (default: 0)")
    parser.add_argument(
        "--quick", action="store_true", help="small cases: to try the command, not to be published"
    )
    parser.add_argument(
        "--no-run", action="store_true", help="write the page from the results there are"
    )
    given = parser.parse_args(arguments)
    # Run what is requested; what fails keeps its older result.
    began = time.perf_counter()
    failed = [] if given.no_run else [name for name in given.only if not _ran(name, given)]
    records = {
        name: record for name in MINUTES if (record := _record(name, given.results)) is not None
    }
    if not given.no_run:
        _tell(f"all runs took {time.perf_counter() - began:.0f} s")
    if not records:
        raise ValueError(f"{given.results} holds no results: run without --no-run first")
    # Write the page from all results that are there.
    make_folder(given.page.parent / given.page.stem)
    summary = _summary(given.page)
    with atomic_write(given.page) as file:
        file.write(page(records, given.results, given.page, failed, summary))
    print(
        f"Wrote {given.page}: {', '.join(records)}"
        + (f"; failed: {', '.join(failed)}" if failed else "")
    )
    return int(bool(failed))


def _ran(name: str, given: argparse.Namespace) -> bool:
    quick = ["--quick"] if given.quick else []
    if name in EXPERIMENTS:
        command = [
            "-m",
            f"experiments.{name}",
            *quick,
            "--seed",
            str(given.seed),
            "--out",
            str(given.results / name),
        ]
    else:
        command = ["-m", "srt_jax", "bench", name, *quick, "--out", str(given.results / "bench")]
    minutes = "under a minute" if given.quick else f"about {MINUTES[name]:g} minutes"
    _tell(f"python {' '.join(command)}   ({minutes})")
    began = time.perf_counter()
    done = subprocess.run([sys.executable, *command], stdout=subprocess.DEVNULL)
    outcome = "took" if done.returncode == 0 else f"failed with code {done.returncode} after"
    _tell(f"{name} {outcome} {time.perf_counter() - began:.0f} s")
    return done.returncode == 0


def _tell(message: str) -> None:
    print(f"{time.strftime('%H:%M:%S')} {message}", file=sys.stderr, flush=True)


def _record(name: str, results: pathlib.Path) -> dict[str, Any] | None:
    path = (
        results / name / f"{name}.json"
        if name in EXPERIMENTS
        else results / "bench" / f"{name}.json"
    )
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def page(
    records: dict[str, dict[str, Any]],
    results: pathlib.Path,
    target: pathlib.Path,
    failed: Sequence[str] = (),
    summary: str = "",
) -> str:
    """Returns the page as Markdown; figures are copied into the folder beside it that bears its
    name.

    failed: runs that ended with an error; they, and those without a record, are named on the page.
    summary: the part written by hand, which stands first.
    """
    parts = [_HEAD, summary] if summary else [_HEAD]
    for name, title in TITLES.items():
        parts.append(f"## {title}")
        if name in failed:
            parts.append(
                "*The latest run failed; what stands here is of an older one, if anything.*"
            )
        parts += (
            _section(name, records[name], results, target)
            if name in records
            else ["*Not run yet.*"]
        )
    return "\n\n".join(parts) + "\n"


def _summary(page: pathlib.Path) -> str:
    """Returns the part of an existing page that is written by hand, with its marks; "" without."""
    text = page.read_text(encoding="utf-8") if page.is_file() else ""
    found = re.search(r"<!-- by hand -->.*<!-- end by hand -->", text, flags=re.DOTALL)
    return found[0] if found else ""


def _section(
    name: str, record: dict[str, Any], results: pathlib.Path, target: pathlib.Path
) -> list[str]:
    """Returns the paragraphs of one run: command, date, machine, figures, tables."""
    date = f"{record['date']}, " if "date" in record else ""
    parts = [
        f"`{_command(record)}`",
        f"*{date}{machine_line(record.get('made_on') or record['machine'])}*",
    ]
    for figure in record.get("figures", []):
        shutil.copyfile(
            results / name / figure["file"], target.parent / target.stem / figure["file"]
        )
        parts.append(
            f"![{figure['file']}]({target.stem}/{figure['file']})\n\n*{figure['caption']}*"
        )
    parts += [as_markdown(Table(**table)) for table in record.get("tables", [])]
    if "text" in record:
        parts.append(f"```\n{record['text']}\n```")
    return parts


def _command(record: dict[str, Any]) -> str:
    """The command without the folder it writes to, which does not change what it
    finds.
    """
    words = record["command"].split()
    place = words.index("--out") if "--out" in words else len(words)
    return " ".join(words[:place] + words[place + 2 :])


_HEAD = """# Results

Made by `python -m experiments.report`, each part by the command above it, on the machine named
there. The same seed gives the same plan lengths and counts; times are medians with quartiles in
brackets, of one run on that machine. PY16 is the paper; its times are of 2016. The text of the
paper gives ranges for Figure 3; the numbers of Figure 2 are those its authors published."""


if __name__ == "__main__":
    run(main)
