"""Space in words: the polar frame of the agent, and fuzzy directions and distances as signs (PY16
§2).
"""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
