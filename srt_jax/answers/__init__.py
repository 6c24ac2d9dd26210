"""What an answer says: in words, as plain data, as a table, beside other answers, and what would
follow if things were otherwise.
"""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
