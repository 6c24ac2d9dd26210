"""Signs and the prediction matrices below them: the sign world model (PY16 §3.1)."""
