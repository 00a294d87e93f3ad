"""The process that reads for another (`two_processes.py` says when): begin and end, what the two say to each other."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import queue
import select
import signal
import struct
import threading
import traceback
import warnings
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn, Protocol, runtime_checkable

from sniff.engine.capture_error import CaptureError
from sniff.engine.observer import Observer, observe_tables
from sniff.engine.session import Completeness, LineEvent

if TYPE_CHECKING:
    from sniff.bus.two_processes import Lends
    from sniff.engine.table import Table

_AHEAD = 2
"""Tables that are made and wait to be judged."""

_UNWANTED = 1 << 20
"""Octets read at a time of what nobody wants any more."""

_PATIENCE = 0.5
"""s that a process is given to end by itself."""

_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux."""


@runtime_checkable
class Wraps(Protocol):
    """What gives the reads of another capture."""

    @property
    def wrapped(self) -> object:
        """The other."""
        ...


@dataclass(frozen=True, slots=True)
class _End:
    """What a process leaves that has read a capture to its end."""

    parts: tuple[Any, ...]
    completeness: Completeness | None


@dataclass(frozen=True, slots=True)
class _Failed:
    """What ended a process: the error, the whole way there in words, and its places (file, line)."""

    error: Exception
    way: str
    places: tuple[tuple[str, int], ...]


def from_another(
    first: Table | LineEvent, items: Iterator[Table | LineEvent], lending: Sequence[Lends], capture: object
) -> Generator[Table | LineEvent, None, None]:
    """The first item, which both processes have, and those that follow."""
    reading, writing = os.pipe()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
    parent = os.getpid()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of numpy's, which know of forks
        process = os.fork()
    if not process:
        try:
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            os.close(reading)
            _end_with_parent(parent)
            _read_for_another(first, items, [one.lend() for one in lending], capture, writing)
        finally:
            os._exit(1)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    os.close(writing)
    for one in lending:
        one.lend()
    with open(reading, "rb") as stream:
        ended = False
        try:
            yield first
            for item in _received(stream):
                if isinstance(item, _End):
                    ended = True
                    _take_back(item, lending, capture)
                elif isinstance(item, _Failed):
                    ended = True
                    item.error.add_note(item.way)
                    raise _with_places(item)
                else:
                    yield item
            if not ended:
                raise CaptureError("the process that read the capture was ended before it was through")
        finally:
            if not ended:
                _end(process, stream)
            os.waitpid(process, 0)
            close = getattr(items, "close", None)
            if close is not None:
                close()


def _take_back(end: _End, lending: Sequence[Lends], capture: object) -> None:
    for one, part in zip(lending, end.parts, strict=True):
        one.take_back(part)
    inner = _innermost(capture)
    if end.completeness is not None:
        told = end.completeness
        inner.completeness = lambda: told


def _innermost(capture: Any) -> Any:
    while isinstance(capture, Wraps):
        capture = capture.wrapped
    return capture


def _end(process: int, stream: io.BufferedReader) -> None:
    """End a process that nobody listens to any more: by asking, then for good."""
    with contextlib.suppress(ProcessLookupError):
        try:
            os.kill(process, signal.SIGINT)
            while select.select([stream], [], [], _PATIENCE)[0]:
                if not os.read(stream.fileno(), _UNWANTED):
                    return
        finally:
            os.kill(process, signal.SIGKILL)


# --- what the two say to each other -------------------------------------------------------------------------------

_COUNTS = struct.Struct("<QQ")
"""Octets of a pickle, and how many buffers follow it; then the length of each, 64 bits."""


def _received(stream: io.BufferedReader) -> Iterator[Any]:
    """What was sent, up to its end or where it was cut off."""
    while len(head := stream.read(_COUNTS.size)) == _COUNTS.size:
        length, count = _COUNTS.unpack(head)
        sizes = stream.read(8 * count)
        if len(sizes) < 8 * count:
            return
        parts = [bytearray(size) for size in (length, *struct.unpack(f"<{count}Q", sizes))]
        if any(stream.readinto(part) < len(part) for part in parts):
            return
        yield pickle.loads(parts[0], buffers=parts[1:])


class _Sender:
    """Sends while its caller goes on, a few tables ahead."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._waiting: queue.Queue[list[Any] | None] = queue.Queue(_AHEAD)
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def send(self, item: object) -> None:
        """Send something; its arrays are not copied, and must not change."""
        buffers: list[pickle.PickleBuffer] = []
        data = pickle.dumps(item, 5, buffer_callback=buffers.append)
        parts = [buffer.raw() for buffer in buffers]
        sizes = struct.pack(f"<{len(parts)}Q", *map(len, parts))
        self._waiting.put([_COUNTS.pack(len(data), len(parts)), sizes, data, *parts])

    def close(self) -> None:
        """Return when all is sent."""
        self._waiting.put(None)
        self._thread.join()

    def _write(self) -> None:
        try:
            while (parts := self._waiting.get()) is not None:
                for part in parts:
                    self._stream.write(part)
                self._stream.flush()
        except OSError:  # nobody listens any more
            os._exit(1)


def _read_for_another(
    first: Table | LineEvent,
    items: Iterator[Table | LineEvent],
    parts: Sequence[Observer],
    capture: object,
    writing: int,
) -> NoReturn:
    """The work of the second process, which ends with it."""
    sender = _Sender(open(writing, "wb"))  # noqa: SIM115  ends with the process
    through = False
    try:
        observe_tables((first,), *parts)
        for item in items:
            sender.send(item)  # first of all: somebody waits for it
            observe_tables((item,), *parts)
        said = getattr(_innermost(capture), "completeness", None)
        sender.send(_End(tuple(parts), None if said is None else said()))
        through = True
    except Exception as error:
        sender.send(_failed(error))
        through = True
    except KeyboardInterrupt:
        pass  # when this is over, whoever reads is closed, and wipes away what it said
    if through:
        sender.close()
    os._exit(0 if through else 1)


def _end_with_parent(parent: int) -> None:
    """Have the system end this process when the one that made it ends, however that ends."""
    import ctypes

    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def _failed(error: Exception) -> _Failed:
    way = "".join(traceback.format_exception(error))
    places = tuple((frame.filename, frame.lineno or 0) for frame in traceback.extract_tb(error.__traceback__))
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return _Failed(RuntimeError(f"{type(error).__name__}: {error}"), way, places)
    return _Failed(error, way, places)


def _with_places(failed: _Failed) -> Exception:
    """The error, which says where it happened, since it has no traceback any more (`sniff/cli` asks for it)."""
    error: Any = failed.error
    error.places_elsewhere = failed.places
    return failed.error
