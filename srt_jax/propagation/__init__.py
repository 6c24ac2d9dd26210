"""How costs and floods are carried over a map: sweeps by rows, queues of cells and words, exact
integers.
"""
