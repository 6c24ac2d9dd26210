"""Data sets of labelled tasks: shards on disk, written one by one, and read back in batches."""

from srt_jax.dataset.folder import read_plan, write_dataset
from srt_jax.dataset.loader import Batches, TaskSource, load
from srt_jax.dataset.specification import Plan

__all__ = ["Batches", "Plan", "TaskSource", "load", "read_plan", "write_dataset"]
