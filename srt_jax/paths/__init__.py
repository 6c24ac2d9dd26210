"""What the path planner reports: reached cells, lengths and a path; or the seed, the contour and
what blocks (PY16 §3.2).
"""
