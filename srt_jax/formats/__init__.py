"""One file per format read or written, `files` for whole files. Described in docs/formats.md.

`reading` and `writing` choose the format by the ending of a file's name; `task_files` makes tasks
of what was read. ROS maps: `ros_map`. Grids of any format become a `gridmap`.
"""
