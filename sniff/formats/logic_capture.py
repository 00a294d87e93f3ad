"""Captures of logic analysers: the octets of the serial lines in them, each bus a capture of its own.

Rate, polarity and format of each channel are found (`uart_finding.py`), channels of one bus are joined
(`wave_buses.py`). Each octet is a read of its own, at the end of its last stop bit, as exact as the samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dissectors.columns import Reads
from dissectors.frame import LineError, Mark
from sniff.engine.blocks import BLOCK_READS, Block, Gathering
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.read_times import ReadTimes
from sniff.engine.session import LINE_NOTE, Adapter, Completeness, Item, LineEvent, Session
from sniff.formats.records import foreign_session
from sniff.formats.several_buses import one_or_several
from sniff.formats.uart import LONGEST, Characters, Decoder
from sniff.formats.uart_finding import SAMPLE, decoded, find, second_stop
from sniff.formats.wave_buses import HeardChannel, WaveBus, buses
from sniff.formats.waves import Edges, WaveFile

if TYPE_CHECKING:
    from dissectors.columns import Times

REPORTS = ("parity", "framing", "break")
AT_ONCE = 1 << 17
"""Edges that are gathered before they are read."""
_ERRORS = [LineError(value) for value in range(8)]


def read_sigrok(path: Path) -> Capture:
    """Open a sigrok session. Raises CaptureError."""
    from sniff.formats.sigrok import SigrokSession

    return one_or_several(path, read(SigrokSession(path)))


def read_vcd(path: Path) -> Capture:
    """Open a value change dump. Raises CaptureError."""
    from sniff.formats.vcd import ValueChanges

    return one_or_several(path, read(ValueChanges(path)))


def read_digital_csv(path: Path) -> Capture:
    """Open a table of levels. Raises CaptureError."""
    from sniff.formats.saleae import DigitalTable

    return one_or_several(path, read(DigitalTable(path)))


def read_voltages(path: Path) -> Capture:
    """Open a table of voltages. Raises CaptureError."""
    from sniff.formats.scope import VoltageTable

    return one_or_several(path, read(VoltageTable(path)))


def read_digital_binary(path: Path) -> Capture:
    """Open a binary export of one digital channel. Raises CaptureError."""
    from sniff.formats.saleae import DigitalBinary

    return one_or_several(path, read(DigitalBinary(path)))


def read(file: WaveFile) -> list[LogicCapture]:
    """The buses of a file, at least one. Raises CaptureError, saying what each channel holds, when there is none."""
    samples, is_all = _sample(file)
    heard, others = [], []
    for channel, (name, edges, level) in enumerate(zip(file.channels, samples, file.levels, strict=True)):
        uart = find(edges, level)
        if uart is None:
            others.append(f"{name} {'never changes' if not len(edges) else f'has {len(edges)} edges or more'}")
            continue
        common = edges[edges <= is_all]
        heard.append(HeardChannel(channel, name, uart, decoded(uart, common, level)))
    heard = [one for one in heard if len(one.sample)]
    if not heard:
        raise CaptureError(
            f"{file.path}: a {file.kind} in which no channel holds serial characters: {', '.join(others[:16])}"
        )
    found = buses(heard)
    return [LogicCapture(file, bus, others if at == 0 else []) for at, bus in enumerate(found)]


def _sample(file: WaveFile) -> tuple[list[Times], int]:
    """The first edges of each channel, and up to when none is missing."""
    held: list[list[Times]] = [[] for _ in file.channels]
    counts = [0] * len(held)
    common = 1 << 62
    for edges in file.stretches():
        for channel, times in enumerate(edges.channels):
            if counts[channel] < SAMPLE and len(times):
                held[channel].append(times[: SAMPLE - counts[channel]])
                counts[channel] += len(held[channel][-1])
                if counts[channel] >= SAMPLE:
                    common = min(common, int(held[channel][-1][-1]))
        if all(count >= SAMPLE for count in counts):
            break
    return [np.concatenate(some) if some else np.zeros(0, np.int64) for some in held], common


class LogicCapture:
    """One bus of a file. A `Capture`."""

    def __init__(self, file: WaveFile, bus: WaveBus, others: Sequence[str]) -> None:
        self.path = file.path
        self._file = file
        self._sides = sorted(bus.sides, key=lambda one: one.channel)
        uart = bus.sides[0].uart
        session = foreign_session(str(file.path), None, file.started, file.kind)
        measured = ", ".join(
            f"{one.name} {one.uart.baud:.0f} Bd{' inverted' if one.uart.inverted else ''}" for one in self._sides
        )
        detail = f"{bus.words}; measured {measured}" + (f"; {file.resolution}" if file.resolution else "")
        if any(second_stop(one.uart, one.sample) for one in self._sides):
            detail += "; after each stop bit a second one, or silence as long"
        if others:
            detail += f"; no characters: {', '.join(others[:16])}"
        self.session: Session = replace(
            session,
            line=uart.line,
            bus=bus.name,
            adapter=Adapter("logic analyser", latency_from="exact times", reports=REPORTS, detail=detail),
            notes={key: text for key, text in session.notes.items() if key != LINE_NOTE},
            reads=ReadTimes(),  # each octet is one, at its own time
        )

    def items(self) -> Iterator[Item]:
        """A chunk an octet, in order of time. Raises CaptureError."""
        for block in self.blocks():
            if isinstance(block, LineEvent):
                yield block
            else:
                yield from block.chunks()

    def blocks(self) -> Iterator[Block | LineEvent]:
        """The same as columns. Raises CaptureError."""
        decoders = [Decoder(one.uart, self._file.levels[one.channel]) for one in self._sides]
        margin = int(LONGEST * max(one.uart.bit for one in self._sides))
        held = Gathering()
        for edges in self._gathered():
            before = edges.until - margin
            for block in _blocks([one.feed(some, before) for one, some in zip(decoders, edges.channels, strict=True)]):
                held.add(block)
                if held.count >= BLOCK_READS:
                    yield held.take()
        nothing = np.zeros(0, np.int64)
        for block in _blocks([one.feed(nothing, 1 << 62) for one in decoders]):
            held.add(block)
        if held.count:
            yield held.take()

    def completeness(self) -> Completeness:
        """Whether the file is whole, as far as it was read."""
        return self._file.completeness()

    def _gathered(self) -> Iterator[Edges]:
        """The edges of the channels of this bus, many at a time."""
        held: list[list[Times]] = [[] for _ in self._sides]
        count = 0
        for edges in self._file.stretches():
            for some, one in zip(held, self._sides, strict=True):
                some.append(edges.channels[one.channel])
                count += len(some[-1])
            if count >= AT_ONCE or len(held[0]) >= 4096:
                yield Edges(edges.until, [np.concatenate(some) for some in held])
                held, count = [[] for _ in self._sides], 0
        if held[0]:
            yield Edges(edges.until, [np.concatenate(some) for some in held])


def _blocks(sides: Sequence[Characters]) -> Iterator[Block]:
    """Characters of all sides in order of time, an octet a read."""
    times = np.concatenate([one.ends for one in sides])
    if not len(times):
        return
    octets = np.concatenate([one.octets for one in sides])
    errors = np.concatenate([one.errors for one in sides])
    if len(sides) > 1:
        order = np.argsort(times, kind="stable")
        times, octets, errors = times[order], octets[order], errors[order]
    marks = {at: (Mark(0, _ERRORS[int(errors[at])]),) for at in np.flatnonzero(errors).tolist()}
    whole = Block(Reads(octets, times, np.ones(len(times), np.int64), errors != 0), marks)
    for first in range(0, len(whole), BLOCK_READS):
        yield whole.cut(first, min(len(whole), first + BLOCK_READS))
