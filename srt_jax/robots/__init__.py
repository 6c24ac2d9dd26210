"""What a robot brings with it: a radius, places in metres, and routes that it can drive."""

from sign_model.foundation.submodules import named_when_asked

__getattr__, __dir__ = named_when_asked(__name__)
