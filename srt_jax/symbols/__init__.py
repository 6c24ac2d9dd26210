"""The gate between the levels: the only part of this package that knows the sign model (PY16 §3).

`planning`: what blocks becomes a situation of signs, and MAP's plan becomes acts, inside jit.
`acts`: where on the route each act ends. `places`: where things are seen, in fuzzy words.
`scene_of_task`: a solved task as a scene that any planner can check, and its plan as a tree.
"""
