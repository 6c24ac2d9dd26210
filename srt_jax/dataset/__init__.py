"""Data sets of labelled tasks: shards on disk, written one by one, and read back in batches."""

from srt_jax.dataset.folder import Plan, load, read_plan, write_dataset

__all__ = ["Plan", "load", "read_plan", "write_dataset"]
