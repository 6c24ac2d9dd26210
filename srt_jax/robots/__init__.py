"""What a robot brings with it: a radius, places in metres, and routes that it can drive."""
