"""One file per format read or written, `shared` for what they have in common. Described in
docs/formats.md.

`reading` and `writing` choose the format by the ending of a file's name; `task_files` makes tasks
of what was read. ROS maps: `ros_map`. Grids of any format become a `gridmap`.
"""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
