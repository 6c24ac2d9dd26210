"""From PDDL text to a grounded planning task, and the independent replay of plans."""
