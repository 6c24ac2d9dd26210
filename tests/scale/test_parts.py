"""Which units are a part's, as typed and as SLURM says."""

import pytest

from srt_jax.scale.parts import Part, as_part


@pytest.mark.parametrize("count", [1, 3, 8])
def test_every_unit_is_in_one_part(count):
    units = [unit for i in range(count) for unit in as_part(f"{i}/{count}").units(10)]
    assert sorted(units) == list(range(10))


def array(index, first=0, last=63, step=1):
    count = (last - first) // step + 1
    names = {"ID": index, "MIN": first, "MAX": last, "COUNT": count, "STEP": step}
    return {f"SLURM_ARRAY_TASK_{name}": str(value) for name, value in names.items()}


def test_slurm_says_the_part():
    assert as_part("slurm", array(7)) == Part(7, 64)
    assert as_part("slurm", array(9, first=1, last=17, step=4)) == Part(2, 5)
    srun = {"SLURM_PROCID": "3", "SLURM_STEP_NUM_TASKS": "4"}
    assert as_part("slurm", srun) == Part(3, 4)
    assert as_part("slurm", srun | array(1, last=1)) == Part(7, 8)
    # a batch script outside srun is one process, whatever was asked for
    assert as_part("slurm", array(7) | {"SLURM_NTASKS": "4", "SLURM_PROCID": "0"}) == Part(7, 64)


@pytest.mark.parametrize("text", ["3", "8/8", "-1/4", "1/0", "a/b", "1/2/3", ""])
def test_what_is_no_part_is_refused(text):
    with pytest.raises(ValueError, match="--part"):
        as_part(text)


def test_slurm_without_an_array_or_with_an_uneven_one_is_refused():
    with pytest.raises(ValueError, match="SLURM_ARRAY_TASK_ID is not set"):
        as_part("slurm", {})
    with pytest.raises(ValueError, match="not evenly spaced"):
        as_part("slurm", array(9, last=9) | {"SLURM_ARRAY_TASK_COUNT": "3"})
