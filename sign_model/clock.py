"""The time limit of a planning call, asked in every phase of it: reading, grounding, search and
replay.
"""

import time


class OutOfTime(Exception):
    """The time limit was reached before there was an answer; a larger `max_seconds` gives more
    time.

    Attributes:
      seconds: the time spent by stage, where the one who raised it knows.

    Examples:
      >>> import sign_model
      >>> sign_model.OutOfTime("the time limit was reached").seconds
      {}
    """

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.seconds: dict[str, float] = {}


class Clock:
    """Measures one time limit from the moment it is made. A limit of None never ends.

    Example:
      clock = Clock(2.5)
      clock.check()  # raises OutOfTime once 2.5 seconds have passed
    """

    def __init__(self, max_seconds: float | None = None) -> None:
        if max_seconds is not None and not max_seconds >= 0:  # also refuses nan
            raise ValueError(f"max_seconds must be 0 or more, got {max_seconds}")
        self.end = None if max_seconds is None else time.perf_counter() + max_seconds

    def is_over(self) -> bool:
        """Returns whether the limit has passed."""
        return self.end is not None and time.perf_counter() > self.end

    def check(self) -> None:
        """Raises OutOfTime once the limit has passed."""
        if self.is_over():
            raise OutOfTime("the time limit was reached: raise max_seconds")


NO_LIMIT = Clock()
