"""Polygons in metres become cells of a grid (PY16 §2)."""
