"""From PDDL text to a grounded planning task, and the independent replay of plans.

In the order of the work: `syntax` (text to forms), `sections`, `domain_reader` and
`problem_reader` (forms to checked records, `lifted`), `reader` (both together), `reachable` and
`grounding` (records to a `PlanningTask`), `validate` (a plan replayed).
"""
