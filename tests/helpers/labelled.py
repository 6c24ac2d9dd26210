"""Random labelled maps for tests, those of the campaigns."""

from experiments.campaigns.inputs.labelled_maps import (
    connected,
    random_tasks,
    scattered,
    task_on,
    walled_tasks,
)

__all__ = ["connected", "random_tasks", "scattered", "task_on", "walled_tasks"]
