"""Regions joined with the least removal: a node-weighted Steiner tree over what separates them.

Beyond the paper, which joins two cells. Whatever eight moves reach, four reach too (`moves`), so
regions are joined through the sides of cells. On the host: graphs of pieces are small.
"""
