"""Work that many processes and machines share: the units of one folder, claims on them, and the
crews that make them.

A job is a folder with the files that are to be there: its units. A unit is done when its file is
there, and a file appears whole or not at all. So whoever comes, and whenever, makes what is
missing, and a claim keeps two from making the same. What travels between processes is the number of
a unit, never an array: each worker reads the inputs and writes the files itself.
"""

from srt_jax.scale.job import Job, Outcome, attempt
from srt_jax.scale.parts import Part
from srt_jax.scale.progress import Standing, standing
from srt_jax.scale.run import run

__all__ = ["Job", "Outcome", "Part", "Standing", "attempt", "run", "standing"]
