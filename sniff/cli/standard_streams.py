"""Standard input, output and error as somebody may have left them: closed, full, in an encoding of few characters."""

from __future__ import annotations

import codecs
import contextlib
import errno
import io
import os
import select
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from _typeshed import ReadableBuffer as Buffer

ESCAPE = "sniff485.escape"
OUTPUT = "standard output"

LOOK_EVERY = 0.1
TAKES_NOTHING_FOR = 1.0
"""Seconds between looks whether it takes something, and for which it may take nothing once all is over."""


def prepare() -> None:
    """Make all three usable, or fail with an OSError when they are used."""
    if None in (sys.stdin, sys.stdout, sys.stderr):
        _hold_descriptors()
    if sys.stdin is None:
        sys.stdin = io.TextIOWrapper(io.BufferedReader(_Closed()))
    if sys.stdout is None:
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(_Closed()), encoding="utf-8")
    if sys.stderr is None:  # nobody listens to it: print() would take standard output instead
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    if type(sys.stdout) is io.TextIOWrapper and sys.stdout is sys.__stdout__ and not sys.stdout.isatty():
        before = sys.stdout
        named = io.BufferedWriter(_Output(before.fileno(), "wb", closefd=False))
        sys.stdout = io.TextIOWrapper(
            named, before.encoding, line_buffering=before.line_buffering, write_through=before.write_through
        )
    codecs.register_error(ESCAPE, _escape)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=ESCAPE)


def say(text: str) -> None:
    """A line on standard error, if that takes it."""
    with contextlib.suppress(OSError, ValueError):
        print(f"sniff485: {text}", file=sys.stderr, flush=True)


def write(parts: Iterable[bytes]) -> None:
    """Print lines that are UTF-8 already, as they are where standard output takes that."""
    stream = sys.stdout
    as_it_is = isinstance(stream, io.TextIOWrapper) and codecs.lookup(stream.encoding).name == "utf-8"
    if not as_it_is or os.linesep != "\n":
        for part in parts:
            stream.write(part.decode())
        return
    stream.flush()
    for part in parts:
        stream.buffer.write(part)
    if stream.line_buffering:
        stream.flush()


def output_error() -> OSError | None:
    """Why standard output does not take what was printed; None when it does. It is given up then, for a quiet end."""
    try:
        sys.stdout.flush()
    except OSError as error:
        give_output_up()
        return error
    except ValueError:  # closed by ourselves
        return None
    return None


class NotTaken(OSError):
    """Whoever reads standard output does not, and nobody waits for it any longer."""


@contextlib.contextmanager
def abandoned_once(over: Callable[[], bool]) -> Iterator[None]:
    """Meanwhile a reader that takes nothing (a pager) is waited for until it is `over`, which is asked some times a
    second, and a second more; then NotTaken is raised. Else a signal would wait as long as the reader likes."""
    _Output.over = staticmethod(over)
    try:
        yield
    finally:
        _Output.over = None


def give_output_up() -> None:
    """Print to nowhere from here on: what the interpreter still holds is written when it ends."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _hold_descriptors() -> None:
    """Keep 0, 1 and 2 from being given to files: what is printed somewhere would end in them."""
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= 2:
        pass
    os.close(descriptor)


class _Output(io.FileIO):
    """Standard output whose errors say that they are of it. `over`: as `abandoned_once` has it."""

    over: Callable[[], bool] | None = None

    def write(self, octets: Buffer) -> int:
        try:
            if self.over is not None and hasattr(select, "poll"):
                self._wait(self.over)
                octets = memoryview(octets)[: select.PIPE_BUF]  # so much is taken without waiting
            return super().write(octets) or 0
        except NotTaken:
            raise
        except OSError as error:
            raise OSError(error.errno, error.strerror, OUTPUT) from None

    def _wait(self, over: Callable[[], bool]) -> None:
        """Until something is taken. Raises NotTaken."""
        reader = select.poll()
        reader.register(self.fileno(), select.POLLOUT)
        left = TAKES_NOTHING_FOR
        while not reader.poll(LOOK_EVERY * 1000):
            left -= LOOK_EVERY * over()
            if left <= 0:
                raise NotTaken(errno.ETIMEDOUT, "nobody takes what is printed", OUTPUT)


class _Closed(io.RawIOBase):
    """A stream that was closed before we came."""

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def readinto(self, _: Buffer) -> int:
        raise OSError(errno.EBADF, "it is closed", "standard input")

    def write(self, octets: Buffer) -> int:
        if self._given_up:
            return memoryview(octets).nbytes
        self._given_up = True  # the interpreter tries again at its end
        raise OSError(errno.EBADF, "it is closed", OUTPUT)

    _given_up = False


SIGNS = str.maketrans(
    {"←": "<-", "→": "->", "−": "-", "–": "-", "—": "-", "×": "x", "…": "...", "±": "+/-", "≤": "<=", "≥": ">="}
    | {"└": "`-", "│": "|", "─": "-", "·": "-", "•": "*", "µ": "u", "Ω": "Ohm", "░": "?"}
)
"""What stands for our own signs where the output has none of them."""


def _escape(error: UnicodeError) -> tuple[str, int]:
    """What is printed where the output has no such character (Windows writes files as cp1252): in a line of JSON
    \\u2190 and such, so that it says the same; elsewhere what people write for our own signs."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    import json  # a terminal has nearly all characters

    there_is_none = error.object[error.start : error.end]
    is_json = error.object.lstrip()[:1] in ("{", "[", '"')
    return json.dumps(there_is_none if is_json else there_is_none.translate(SIGNS))[1:-1], error.end
