"""Processes of `sniff485` that begin without a start of Python: forks of one that has imported what commands use.
So does pytest where the plugin is tried in a project of its own.

To start an interpreter and import a command takes a quarter of a second of a core, which is more than most tests of
whole processes take for what they try. `Popen` and `run` are those of `subprocess`, and what they begin is a process
as any other: its own arguments, folder, environment, streams, session, signals and end. Whoever sets what only a start
reads (`READ_AT_START`), or has something else to run, gets a start, as where there is no fork.

    the test ──order and descriptors──► the warm process ──fork──► the command
             ◄────────pid, then how it ended────────

`tests/sniff/cli/test_start.py` and its neighbours start Python itself: what a command imports is tried there.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import json
import os
import runpy
import select
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO

ROOT = Path(__file__).parents[2]
PYTHON = [sys.executable, "-m"]
MODULES = ("sniff", "pytest")
"""What is begun so."""
READ_AT_START = ("PYTHON", "LC_", "LANG", "TZ", "LD_", "MALLOC")
"""How names of variables begin that an interpreter and its libraries read once."""

_AT_START = dict(os.environ)
"""What the warm process reads, whatever a test has set meanwhile."""

_HEAD = struct.Struct("!I")
_USED = (
    *(f"sniff.cli.{name}" for name in ("box", "check", "demo", "detect", "extcap", "live", "points", "record", "show")),
    *("dissectors.bacnet", "dissectors.modbus", "dissectors.n2", "dissectors.profibus", "numpy", "mcap.reader"),
    "pytest",
)


class Popen(subprocess.Popen[Any]):
    """As `subprocess.Popen`; a command of ours begins at once where nothing speaks against it."""

    _told: int | None = None  # a pipe that brings the exit code of one that was forked

    def _execute_child(self, args: Any, executable: Any, preexec_fn: Any, close_fds: Any, pass_fds: Any, cwd: Any,
                       env: Any, startupinfo: Any, creationflags: Any, shell: Any, *more: Any) -> None:  # fmt: skip
        pipes, (*_, start_new_session, process_group) = more[:6], more[6:]
        if preexec_fn or pass_fds or shell or process_group >= 0 or not _may_be_forked(args, env):
            given = args, executable, preexec_fn, close_fds, pass_fds, cwd, env, startupinfo, creationflags, shell
            super()._execute_child(*given, *more)  # type: ignore[misc]
            return
        ends = pipes[0], pipes[3], pipes[5]
        order = {
            "words": list(map(os.fspath, args[len(PYTHON) :])),
            "folder": os.path.abspath(cwd or "."),
            "environment": dict(os.environ if env is None else env),
            "is_leader": bool(start_new_session),
        }
        self._told, telling = os.pipe()
        try:
            streams = [number if end < 0 else end for number, end in enumerate(ends)]
            _send(_warm(), order, [*streams, telling])
            self.pid = int.from_bytes(os.read(self._told, 4), "big")
            assert self.pid, "the warm process has ended"
        finally:
            os.close(telling)
        self._child_created = True
        self._close_pipe_fds(*pipes)  # type: ignore[attr-defined]

    def _internal_poll(self, _deadstate: int | None = None, **more: Any) -> int | None:
        if self._told is None and self.returncode is None:
            return super()._internal_poll(_deadstate, **more)  # type: ignore[misc, no-any-return]
        try:
            return self._wait(0)
        except subprocess.TimeoutExpired:
            return None

    def _wait(self, timeout: float | None) -> int:
        if self._told is None and self.returncode is None:
            return super()._wait(timeout)  # type: ignore[misc, no-any-return]
        with self._waitpid_lock:  # type: ignore[attr-defined]
            if self.returncode is None:
                assert self._told is not None
                if not select.select([self._told], [], [], timeout)[0]:
                    raise subprocess.TimeoutExpired(self.args, timeout or 0)
                self.returncode = int(os.read(self._told, 20) or -signal.SIGKILL)
                os.close(self._told)
                self._told = None
        return self.returncode


def run(*given: Any, capture_output: bool = False, timeout: float | None = None, check: bool = False, **options: Any
        ) -> subprocess.CompletedProcess[Any]:  # fmt: skip
    """As `subprocess.run`, without `input`."""
    if capture_output:
        options |= {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with Popen(*given, **options) as process:
        try:
            output, errors = process.communicate(timeout=timeout)
        except BaseException:
            process.kill()
            raise
    done = subprocess.CompletedProcess(process.args, process.returncode, output, errors)
    if check:
        done.check_returncode()
    return done


def _may_be_forked(args: Any, environment: Mapping[str, str] | None) -> bool:
    if not isinstance(args, Sequence) or list(args[:-1][: len(PYTHON)]) != PYTHON or args[len(PYTHON)] not in MODULES:
        return False
    if not hasattr(os, "fork"):
        return False
    return _read_at_start(os.environ if environment is None else environment) == _read_at_start(_AT_START)


def _read_at_start(environment: Mapping[str, str]) -> dict[str, str]:
    found = {name: value for name, value in environment.items() if name.startswith(READ_AT_START)}
    if found.get("PYTHONPATH") == str(ROOT):  # where it finds us anyway
        del found["PYTHONPATH"]
    return found


@cache
def _warm() -> socket.socket:
    """The process of which the others are forks; it ends with this one."""
    ours, theirs = socket.socketpair()
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.e2e.warm_start", str(theirs.fileno())],
            cwd=ROOT, env={**_AT_START, "PYTHONPATH": str(ROOT)}, pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def end() -> None:
        ours.close()
        process.wait()

    atexit.register(end)
    return ours


def _send(connection: socket.socket, order: dict[str, Any], descriptors: list[int]) -> None:
    message = json.dumps(order).encode()
    socket.send_fds(connection, [_HEAD.pack(len(message))], descriptors)
    connection.sendall(message)


def _received(connection: socket.socket) -> tuple[dict[str, Any], list[int]] | None:
    head, descriptors, _, _ = socket.recv_fds(connection, _HEAD.size, 4)
    if not head:
        return None
    message = b""
    while len(message) < _HEAD.unpack(head)[0]:
        message += connection.recv(_HEAD.unpack(head)[0] - len(message))
    return json.loads(message), descriptors


def _serve(connection: socket.socket) -> dict[str, Any] | None:
    """Fork for each order, and tell of each fork how it ended; in a fork, its order. None when nobody asks any more."""
    telling: dict[int, int] = {}
    woken, waker = os.pipe()
    os.set_blocking(waker, False)
    signal.set_wakeup_fd(waker, warn_on_full_buffer=False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    while True:
        ready = select.select([connection, woken], [], [])[0]
        if woken in ready:
            os.read(woken, 4096)
            for pid in list(telling):
                ended, how = os.waitpid(pid, os.WNOHANG)
                if ended:
                    _tell(telling.pop(pid), str(os.waitstatus_to_exitcode(how)).encode())
        if connection in ready:
            if (asked := _received(connection)) is None:
                return None
            order, (*streams, teller) = asked
            if not (pid := os.fork()):
                connection.detach()  # closed with all that is not of the command
                _take_place(order, streams)
                return order
            for stream in streams:
                os.close(stream)
            os.write(teller, pid.to_bytes(4, "big"))
            telling[pid] = teller


def _tell(teller: int, words: bytes) -> None:
    with contextlib.suppress(BrokenPipeError):  # nobody wants to know
        os.write(teller, words)
    os.close(teller)


def _take_place(order: dict[str, Any], streams: list[int]) -> None:
    """Be as a process that has just begun."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    if order["is_leader"]:
        os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    os.closerange(3, max(map(int, os.listdir("/dev/fd"))) + 1)
    os.chdir(order["folder"])
    os.environ.clear()
    os.environ.update(order["environment"])
    sys.stdin, sys.stdout, sys.stderr = (_made_anew(*one) for one in enumerate((sys.stdin, sys.stdout, sys.stderr)))
    sys.__stdin__, sys.__stdout__, sys.__stderr__ = sys.stdin, sys.stdout, sys.stderr
    sys.path[0] = order["folder"]
    sys.argv = order["words"]


def _made_anew(number: int, before: TextIO) -> TextIO:
    """A standard stream, as Python makes it of what the descriptor is now."""
    size = 0 if number and os.environ.get("PYTHONUNBUFFERED") else -1
    by_lines, ends = number == 2 or os.isatty(number), "\n" if number else None
    octets: Any = open(number, "wb" if number else "rb", size, closefd=False)  # noqa: SIM115
    return TextIOWrapper(octets, before.encoding, before.errors, ends, by_lines, write_through=not size)


def main(descriptor: int) -> None:
    for name in _USED:
        import_module(name)
    gc.freeze()  # what stays is not gone through, and so not copied, in any of them
    with socket.socket(fileno=descriptor) as connection:
        order = _serve(connection)
    if order is not None:
        runpy.run_module(order["words"][0], run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
