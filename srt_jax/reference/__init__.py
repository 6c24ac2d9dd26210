"""Slow and obvious twins of the kernels: plain Python, no import of ours but the records, hence
no slip in common.
"""
