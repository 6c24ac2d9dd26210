"""Slow and obvious twins of the kernels, the oracles that the tests judge them by: plain Python, no
import of ours but the records, hence no slip in common.
"""
