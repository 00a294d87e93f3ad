"""The end of a process whose output a test has begun to read by lines."""

from __future__ import annotations

import subprocess
from concurrent.futures import ThreadPoolExecutor

PATIENCE = 60.0
"""Seconds for it to end: so long only where this machine is overloaded, or it never will."""


def rest_of(process: subprocess.Popen[str], patience: float = PATIENCE) -> tuple[str, str]:
    """What a process says until it ends, on standard output and on standard error; killed when it does not end.

    `Popen.communicate` reads past what reading a line has taken into the buffer: lines that came together with the
    last one read would be missing, which depends on how busy the machine is.
    """
    assert process.stdout is not None
    assert process.stderr is not None
    with ThreadPoolExecutor(2) as readers:
        said = [readers.submit(stream.read) for stream in (process.stdout, process.stderr)]
        try:
            output, errors = (one.result(patience) for one in said)
            process.wait(patience)
        except BaseException:
            process.kill()  # its pipes are closed then, and the readers end
            raise
    return output, errors
