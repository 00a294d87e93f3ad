"""How a capture process ended, as far as the system says; also of one that a disk holds on to.

A thread that hangs in the kernel cannot be killed, and until the disk lets go of it the process is not given to whoever
waits for its end, and its connection stays open. Linux says at least that the rest of it is gone.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from pathlib import Path

_STATE, _EXIT_CODE = 0, 49
"""Words of /proc/PID/stat after the name: fields 3 and 52 of proc(5)."""


def exit_code(process: subprocess.Popen[bytes]) -> int | None:
    """As `Popen` has it, minus a signal's number; None while the process runs."""
    code = process.poll()
    return _code_of_held(process.pid) if code is None else code


def awaited_exit_code(process: subprocess.Popen[bytes], seconds: float) -> int | None:
    """The same, after waiting at most so long for one that is about to end."""
    code = exit_code(process)
    if code is None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        code = exit_code(process)
    return code


def in_words(code: int | None, said: bytes) -> str:
    """Why nothing comes any more. `said`: the end of what it wrote to its standard error."""
    if code is None:
        return "capture process does not answer"
    last = said.decode("utf-8", "replace").strip().splitlines()[-1:]
    how = f"was ended by {_signal_name(-code)}" if code < 0 else f"ended with code {code}"
    return f"capture process {how}" + "".join(f": {line}" for line in last)


def _signal_name(number: int) -> str:
    """Most real-time signals have none."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _code_of_held(pid: int) -> int | None:
    """Of a process whose main thread is gone while another is held; None for one that runs, or where nobody knows."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        return os.waitstatus_to_exitcode(int(words[_EXIT_CODE])) if words[_STATE] in {"Z", "X"} else None
    except (OSError, ValueError, IndexError):
        return None
