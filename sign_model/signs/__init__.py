"""Signs and the prediction matrices below them: the sign world model (PY16 §3.1)."""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
