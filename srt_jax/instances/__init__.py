"""Made-up instances: base maps, the blockers of the paper, rooms, fences and rings with known
optimum.
"""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
