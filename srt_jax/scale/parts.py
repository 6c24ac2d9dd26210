"""A part of a job's units, as typed after --part or as SLURM says it."""

import os
from collections.abc import Mapping
from typing import NamedTuple


class Part(NamedTuple):
    """The units i, i + n, i + 2 n, ... of all: part i of n, from 0."""

    index: int = 0
    count: int = 1

    def units(self, total: int) -> range:
        """Returns the numbers of this part's units."""
        return range(self.index, total, self.count)


def as_part(text: str | None, env: Mapping[str, str] | None = None) -> Part:
    """Returns the part typed after --part: "I/N" with I from 0 to N - 1, or "slurm"; all units
    where nothing was typed.

    With "slurm" each task of a job array is one part, and so is each process that `srun` started.

    Raises:
      ValueError: neither form; or SLURM's variables are missing or name no part.
    """
    if text is None:
        return Part()
    if text == "slurm":
        return _of_slurm(os.environ if env is None else env)
    index, slash, count = text.partition("/")
    if not slash or not all(number.isdecimal() for number in (index, count)):
        raise ValueError(f"--part must be I/N, such as 0/8, or slurm, got {text!r}")
    part = Part(int(index), int(count))
    if not part.index < part.count:
        raise ValueError(
            f"--part {text}: parts are counted from 0: the last of {part.count} is"
            f" {part.count - 1}/{part.count}"
            if part.count
            else f"--part {text}: there must be one part at least"
        )
    return part


def _of_slurm(env: Mapping[str, str]) -> Part:
    in_array, in_step = "SLURM_ARRAY_TASK_ID" in env, "SLURM_STEP_NUM_TASKS" in env
    if not in_array and not in_step:
        raise ValueError(
            "--part slurm: SLURM_ARRAY_TASK_ID is not set: submit with sbatch --array=0-63 (or"
            " start by srun), or give --part I/N"
        )
    part = Part()
    if in_array:
        first, last, count = (
            _number(env, f"SLURM_ARRAY_TASK_{name}") for name in ("MIN", "MAX", "COUNT")
        )
        step = _number(env, "SLURM_ARRAY_TASK_STEP") if "SLURM_ARRAY_TASK_STEP" in env else 1
        index, rest = divmod(_number(env, "SLURM_ARRAY_TASK_ID") - first, step)
        if rest or first + (count - 1) * step != last or not 0 <= index < count:
            raise ValueError(
                "--part slurm: the numbers of the array are not evenly spaced: submit a range"
                " such as --array=0-63, or give --part I/N"
            )
        part = Part(index, count)
    if in_step:
        index, count = _number(env, "SLURM_PROCID"), _number(env, "SLURM_STEP_NUM_TASKS")
        part = Part(part.index * count + index, part.count * count)
    return part


def _number(env: Mapping[str, str], name: str) -> int:
    text = env.get(name, "")
    if not text.isdecimal():
        raise ValueError(
            f"--part slurm: {name} must be a whole number, got {text!r}: give --part I/N"
        )
    return int(text)
