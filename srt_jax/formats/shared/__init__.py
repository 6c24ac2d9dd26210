"""What readers of every format need: files read whole, rows of a scenario, where a task starts."""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
