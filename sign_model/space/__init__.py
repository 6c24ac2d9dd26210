"""Space in words: the polar frame of the agent, fuzzy directions and distances as signs (PY16
§2).
"""
