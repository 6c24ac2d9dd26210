"""What the formats of polygons share: odd geometries, projections, tag rules, SVG paths."""
