"""Space in words: the polar frame of the agent, and fuzzy directions and distances as signs (PY16
§2).
"""
