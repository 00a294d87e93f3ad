"""Not one octet leaves: seen from the other side of the port, and by reading every line of the code."""

from __future__ import annotations

import ast
import os
import select
import time
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.capture.ipc import ReceivedMessage
from sniff.capture.link import CaptureLink, RecordSpec, SourceSpec

ROOT = Path(__file__).parents[2]
FOLDERS = ("sniff/sources", "sniff/capture")

SENDING = {
    "write", "writelines", "writev", "pwrite", "pwritev", "sendfile", "splice", "send", "sendall", "sendto", "sendmsg",
    "send_break", "sendBreak", "tcsendbreak", "tcflow", "setRTS", "setDTR", "set_output_flow_control",
    "set_input_flow_control", "TIOCSTI", "TIOCMBIS", "TIOCMSET", "TIOCSBRK", "fdopen",
    "O_RDWR", "O_WRONLY", "O_APPEND",
}  # fmt: skip

ALLOWED = {
    # to the main process and back, never to a port
    ("sniff/capture/ipc_sender.py", "Outlet.flush", "send"),
    ("sniff/capture/link.py", "CaptureLink._send", "send"),
    ("sniff/capture/link.py", "CaptureLink._greet", "sendall"),
    ("sniff/capture/process.py", "main", "sendall"),
    ("sniff/capture/process.py", "connect", "sendall"),
    ("sniff/capture/spawn.py", "_spawn_and_listen", "write"),
    # one octet from a thread to the loop of the same process
    ("sniff/sources/rfc2217.py", "_ListeningGateway.wake", "send"),
}


def uses(path: Path, root: Path = ROOT) -> set[tuple[str, str, str]]:
    """Every name in a file that could send something, with the function that uses it."""
    found = set()
    relative = str(path.relative_to(root))

    def visit(node: ast.AST, where: str) -> None:
        for child in ast.iter_child_nodes(node):
            inside = where
            if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                inside = f"{where}.{child.name}".lstrip(".")
            name = getattr(child, "attr", None) or getattr(child, "id", None)
            # naming a method in order to replace it by a refusal is no use of it
            if name in SENDING and isinstance(getattr(child, "ctx", None), ast.Load):
                found.add((relative, inside, name))
            if isinstance(child, ast.Constant) and child.value in SENDING:
                found.add((relative, inside, str(child.value)))
            visit(child, inside)

    visit(ast.parse(path.read_text(encoding="utf-8")), "")
    return found


def test_no_code_path_could_send() -> None:
    files = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    assert len(files) > 15
    found = {use for path in files for use in uses(path)}
    assert found - ALLOWED == set()
    assert ALLOWED - found == set(), "no longer there: take it off the list"


@pytest.mark.parametrize(
    "code",
    [
        "port.write(b'x')",
        "os.write(fd, b'x')",
        "f = port.write",
        "getattr(port, 'write')",
        "fcntl.ioctl(fd, TIOCMBIS, x)",
        "os.open(port, os.O_RDWR)",
    ],
)
def test_the_reading_of_the_code_finds_what_it_is_for(tmp_path, code) -> None:
    file = tmp_path / "bad.py"
    file.write_text(f"def oops(port, fd, x):\n    {code}\n")
    assert {use[:2] for use in uses(file, tmp_path)} == {("bad.py", "oops")}


@pytest.mark.parametrize("token", ["19200,8E1", "115200,8N1", "76800,8N1"])
def test_not_one_octet_leaves(tmp_path, token) -> None:
    """A terminal in its usual state would echo, answer Ctrl-C and send XOFF; a port that listens does nothing."""
    pytest.importorskip("termios")
    master, slave = os.openpty()
    port = os.ttyname(slave)
    os.close(slave)
    hostile = bytes(range(256)) * 8 + b"\x03\x04\x11\x13\r\n\x1a\x1c" * 64
    heard = bytearray()
    taken = bytearray()
    try:
        spec = SourceSpec(port, LineSettings.parse(token))
        with CaptureLink.start([spec], RecordSpec(str(tmp_path / "x.mcap"))) as link:
            os.set_blocking(master, False)
            rest = hostile * 8  # more than a tty's buffer holds
            until = time.monotonic() + 20
            while len(taken) < len(hostile) * 8:
                assert time.monotonic() < until, f"{len(taken)} octets of {len(hostile) * 8}"
                if rest and select.select([], [master], [], 0)[1]:
                    rest = rest[os.write(master, rest[:1500]) :]
                heard += listen(master)
                for message in link.receive(0.01):
                    if isinstance(message, ReceivedMessage) and isinstance(message.item, Chunk):
                        taken += message.item.octets
            link.reconfigure(0, LineSettings.parse("9600,7O2"))
            link.receive(0.2)
            heard += listen(master)
        heard += listen(master)
    finally:
        os.close(master)
    assert bytes(taken) == hostile * 8
    assert bytes(heard) == b""


def listen(master: int) -> bytes:
    """What the other side of the port has sent."""
    try:
        return os.read(master, 65536)
    except OSError:  # nothing, or nobody there any more
        return b""
