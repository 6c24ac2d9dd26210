"""Forward state-space search: A*, weighted A* and greedy best-first, to compare MAP with."""
