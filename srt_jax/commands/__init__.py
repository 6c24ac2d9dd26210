"""The commands of `srt-jax`, one file each; each returns its exit code."""
