"""The MAP algorithm for one task: goal regression with M-, A- and P-step (PY16 §3.1).

`map_planner`: the iteration, with its M- and P-step. `a_step`: the A-step, by the tables of
`landmarks` and the signs of `heuristics`; `authors_rule` is the rule that the paper's authors use.
`plan_specification`: what follows a plan.
"""
