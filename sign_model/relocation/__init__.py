"""The smart relocation task on the symbolic level, and MAP over a working memory inside jit (PY16
§2, §3.1).
"""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
