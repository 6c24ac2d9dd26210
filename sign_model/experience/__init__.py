"""Experience: precedents kept in memory, and heuristic weights learned from solved tasks (PY16
§3.1).
"""
