"""The terminal UI in a browser, at http://127.0.0.1:8485: several viewers of one capture, each with a view of its own.
A port or configured bus is recorded, by one process, and viewers look at the recording as it grows, a second behind the
bus: what they do never touches the port. Only this machine may look, unless --allow-remote and a token say otherwise;
the token (in the variable SNIFF485_TOKEN, or in a file) travels as plain as the page does: beyond one's own network a
proxy with TLS belongs before it. It needs `pip install 'sniff485[serve]'`.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import os
import re
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from sniff.analysis.sanitizing import sanitized
from sniff.cli import UNREADABLE, USAGE, Failure, arguments, targets
from sniff.formats.table import suffixes
from sniff.outlet_settings import TOKEN_ENV, Secret, SettingsError
from sniff.tui.guest import GUEST

PORT = 8485
LOOK = 0.2
"""Seconds between two looks for a recording that is to begin."""
ENDING = 15.0
"""Seconds that a recording may take to end."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `serve`."""
    parser.add_argument("source", metavar="FILE|PORT|BUS", help="a capture, a port, or a configured bus")
    arguments.add_line(parser)
    arguments.add_devices(parser)
    arguments.add_recording(parser, "a port: recording (.mcap); default: a new name here")
    parser.add_argument(
        "--host", default="127.0.0.1", metavar="ADDRESS", help="address to serve at (default: 127.0.0.1)"
    )
    parser.add_argument(
        "--port", type=arguments.tcp_port, default=PORT, metavar="N", help="default: 8485; 0: any free one"
    )
    parser.add_argument("--allow-remote", action="store_true", help="let others than this machine look; needs a token")
    parser.add_argument(
        "--token-file", metavar="FILE", help=f"what viewers must know, at least 16 characters; default: {TOKEN_ENV}"
    )


def run(args: argparse.Namespace) -> int:
    """Serve until a signal."""
    try:
        import textual_serve  # noqa: F401
    except ImportError:
        raise Failure("this needs textual-serve: pip install 'sniff485[serve]'", USAGE) from None
    from sniff.browser.access import Access

    access = Access(_token(args), args.allow_remote)
    if _is_file(args.source):
        if args.write:
            raise Failure("-w: a file is not recorded again", USAGE)
        arguments.open_buses(args.source)
        return _serve(args, access, [os.path.abspath(args.source)])
    with _recorded(args) as path:
        code = _serve(args, access, ["--follow", path])
    print(f"sniff485: recorded to {sanitized(path)}", file=sys.stderr)
    return code


def _token(args: argparse.Namespace) -> str:
    """The token, where one is said. Ends with exit code 2 where others may come without one."""
    from sniff.browser.access import LEAST_TOKEN, is_loopback

    try:
        token = Secret(TOKEN_ENV, args.token_file or "").read() or ""
    except SettingsError as error:
        raise Failure(f"--token-file: {error}", USAGE) from None
    if token and (len(token) < LEAST_TOKEN or not re.fullmatch(r"[A-Za-z0-9_-]+", token)):
        raise Failure(f"the token: at least {LEAST_TOKEN} letters, digits, - and _; {_another()}", USAGE)
    if args.allow_remote and not token:
        raise Failure(f"--allow-remote: needs a token, in {TOKEN_ENV} or a file (--token-file); {_another()}", USAGE)
    if not args.allow_remote and not is_loopback(args.host):
        raise Failure(f"--host {args.host}: others could look; say so with --allow-remote and a token", USAGE)
    return token


def _another() -> str:
    return f"for instance {secrets.token_hex(12)}"


def _is_file(source: str) -> bool:
    return source.lower().endswith(suffixes()) or Path(source).is_file()


def _serve(args: argparse.Namespace, access: object, shown: list[str]) -> int:
    from sniff.browser.access import Access
    from sniff.browser.server import Viewing

    assert isinstance(access, Access)

    def ready(port: int) -> None:
        host = f"[{args.host}]" if ":" in args.host else args.host
        secret = "/?token=…" if access.token else "/"
        shown = f"{sanitized(args.source)} at http://{host}:{port}{secret}"
        print(f"sniff485: showing {shown}; Ctrl-C ends it", file=sys.stderr)

    if args.allow_remote:
        os.environ[GUEST] = "1"
    command = [sys.executable, "-m", "sniff", "open", *_options(args), *shown]
    viewing = Viewing(command, args.host, args.port, f"sniff485 {args.source}", access, ready)
    try:
        asyncio.run(_until_told(viewing))
    except OSError as error:
        raise Failure(f"{args.host}:{args.port}: cannot be served at: {error.strerror or error}", USAGE) from None
    return 0


async def _until_told(viewing: object) -> None:
    from sniff.browser.server import Viewing

    assert isinstance(viewing, Viewing)
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for one in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C comes as KeyboardInterrupt
            loop.add_signal_handler(one, ended.set)
    await viewing.serve_until(ended)


def _options(args: argparse.Namespace) -> list[str]:
    """-s, -p and -d, as they were said."""
    said = [f"--device={address}={profile}" for address, profile in args.devices]
    if args.line is not None:
        said.append(f"--line={args.line}")
    if args.protocol is not None:
        said.append(f"--protocol={args.protocol}")
    return said


@contextlib.contextmanager
def _recorded(args: argparse.Namespace) -> Iterator[str]:
    """A port recorded by a process of its own, until this ends; the path of the recording."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", Path(args.source).name).strip("-") or "bus"
    path = os.path.abspath(args.write or targets.new_recording(name))
    targets.refuse_recording(path)
    command = [sys.executable, "-m", "sniff", "record", args.source, "-q", "-w", path, *_options(args)]
    recorder = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    try:
        _wait_for(path, recorder)
        yield path
    finally:
        recorder.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            recorder.wait(ENDING)


def _wait_for(path: str, recorder: subprocess.Popen[bytes]) -> None:
    """Until the recording says how it is to be read. Ends with the recorder's exit code where it ends before."""
    from sniff.engine.capture import CaptureError
    from sniff.recording.following import Following

    said = False
    while True:
        if recorder.poll() is not None:
            raise Failure("nothing is recorded, so there is nothing to show", recorder.returncode or UNREADABLE)
        with contextlib.suppress(CaptureError, OSError):
            if not Following(path).session.unknown:
                return
            if not said:
                print("sniff485: searching for the settings; recording meanwhile", file=sys.stderr)
                said = True
        time.sleep(LOOK)
