"""Start the capture process and connect to it, on every system."""

from __future__ import annotations

import contextlib
import os
import secrets
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from sniff import version

CONNECT_PATIENCE = 20.0
_TOKEN_SIZE = 32


@dataclass(frozen=True, slots=True)
class Spawned:
    """A process, the connection to it, and what it says on its standard error."""

    process: subprocess.Popen[bytes]
    connection: socket.socket
    errors: IO[bytes]


def spawn(words: Sequence[str]) -> Spawned:
    """Start it. `words` follow the module's name, for people who look at a list of processes. Raises OSError."""
    errors = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the process)
    command = [sys.executable, "-P", "-m", "sniff.capture.process", *words]
    options: dict[str, Any] = {"stdout": errors, "stderr": errors, "env": environment()}
    start = _spawn_with_socket if os.name == "posix" else _spawn_and_listen
    try:
        return start(command, options, errors)
    except BaseException:
        errors.close()
        raise


def _spawn_with_socket(command: list[str], options: dict[str, Any], errors: IO[bytes]) -> Spawned:
    ours, theirs = socket.socketpair()
    try:
        with theirs:
            process = subprocess.Popen(command, stdin=theirs.fileno(), start_new_session=True, **options)
    except BaseException:
        ours.close()
        raise
    return Spawned(process, ours, errors)


def _spawn_and_listen(command: list[str], options: dict[str, Any], errors: IO[bytes]) -> Spawned:
    """Where a socket cannot be inherited as standard input (Windows): it connects to us and proves who it is."""
    flags = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0) | getattr(subprocess, "HIGH_PRIORITY_CLASS", 0)
    token = secrets.token_bytes(_TOKEN_SIZE)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(CONNECT_PATIENCE)
        process = subprocess.Popen(command, stdin=subprocess.PIPE, creationflags=flags, **options)
        assert process.stdin is not None
        try:
            with process.stdin as pipe:
                pipe.write(f"{server.getsockname()[1]} {token.hex()}\n".encode())
            while not _proves(connection := server.accept()[0], token):
                connection.close()
            return Spawned(process, connection, errors)
        except BaseException:
            process.kill()
            process.wait()
            raise


def _proves(connection: socket.socket, token: bytes) -> bool:
    """Whether it is our process that has connected: a stranger sends something else, nothing, or goes away."""
    connection.settimeout(CONNECT_PATIENCE)
    data = b""
    with contextlib.suppress(OSError):
        while len(data) < len(token) and (part := connection.recv(len(token) - len(data))):
            data += part
    return secrets.compare_digest(data, token)


def environment() -> dict[str, str]:
    """The process must find this very package, and nothing in the current folder."""
    root = str(Path(version.__file__).resolve().parents[1])
    environment = dict(os.environ)
    if not root.endswith(("site-packages", "dist-packages")):
        paths = [root, *filter(None, [environment.get("PYTHONPATH")])]
        environment["PYTHONPATH"] = os.pathsep.join(paths)
    return environment
