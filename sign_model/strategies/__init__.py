"""Ways of planning, and the metacognitive rule that gives them their turns (PY16 §3.1).

`rule`: the rule as a record. `turns`: carries it out. `forwards`, `goal_by_goal`: the iteration of
MAP carried out from the start; `curiously`: likewise, what is new first; `alike`, `landmarks_left`
and `forward_task` serve them. `improve`: makes a plan shorter part by part, the parts from
`windows`. `proven`: beams widen until a plan is as short as any can be.
"""
