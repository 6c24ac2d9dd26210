"""Polygons in metres become cells of a grid (PY16 §2)."""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
