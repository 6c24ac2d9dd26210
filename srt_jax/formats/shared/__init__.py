"""What readers of every format need: files read whole, rows of a scenario, where a task starts."""
