"""The commands of `srt-jax`, one file each; each returns its exit code. `plan` has a second file,
`short_plan`, which does the work without loading JAX.
"""
