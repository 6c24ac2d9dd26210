"""Made-up instances: base maps, the blockers of the paper, rooms, fences and rings with known
optimum.
"""
