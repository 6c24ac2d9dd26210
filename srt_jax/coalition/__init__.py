"""A coalition: several agents with different abilities on one map, who help each other by
destroying obstacles (PY16 [18]: Panov & Yakovlev, RiTA 2016).
"""
