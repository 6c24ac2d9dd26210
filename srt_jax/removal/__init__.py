"""What to destroy: the loop of the paper, and the least removal with its proven bound (PY16 §3.2
and beyond).
"""
