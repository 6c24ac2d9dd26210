"""What people see of the symbolic level: the iterations of MAP step by step, and pictures (SVG) of
them and of the three semantic networks.
"""
