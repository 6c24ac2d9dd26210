"""Whether XLA knows the flags that the environment gives it.

It reads them when the first array is made, and where it does not know one it ends the process with
code 1, which here means that a task cannot be solved. So they are tried in a process of their own,
which takes a tenth of a second, and only where there are any.
"""

import re
import subprocess
import sys
from collections.abc import Mapping

_TRIAL = "from jaxlib import xla_client; xla_client.make_cpu_client()"
_MOST_SECONDS = 30
_REASON = re.compile(r"Unknown flags? in XLA_FLAGS.*|Couldn't interpret value .*")


def what_is_wrong(environment: Mapping[str, str]) -> str | None:
    """Returns what is wrong with XLA_FLAGS, and what to do; None where nothing is, or where nobody
    can say.
    """
    if not environment.get("XLA_FLAGS", "").strip():
        return None
    try:
        done = subprocess.run(
            [sys.executable, "-c", _TRIAL],
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_MOST_SECONDS,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    reason = _REASON.search(done.stderr)
    if not done.returncode or reason is None:
        return None
    return f"the environment variable XLA_FLAGS: {reason[0].rstrip('. ')}; correct it, or unset it"
