"""The MAP algorithm for many tasks in one compiled search, on words of 32 bits.

`ladder`: from tasks to batches, with wider beams for what is left. `iteration`: the compiled
search; `steps`: its M-, P- and A-step. The others are the tables and slots that the search uses.
"""
