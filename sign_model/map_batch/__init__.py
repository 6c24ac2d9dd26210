"""The MAP algorithm for many tasks in one compiled search, on words of 32 bits."""
