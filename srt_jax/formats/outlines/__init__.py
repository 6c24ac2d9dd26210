"""What the formats of polygons share: odd geometries, projections, tag rules, SVG paths."""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
