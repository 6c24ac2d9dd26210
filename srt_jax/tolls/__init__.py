"""Break or go round: the least sum of length and tolls, a toll for each obstacle entered.

Beyond the paper, which looks at what blocks only where no path exists.
"""
