"""The MAP algorithm for one task: goal regression with M-, A- and P-step (PY16 §3.1)."""
