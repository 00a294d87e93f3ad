"""What happens to octets on the way from a driver to the program, for `framing_table.py`.

One entry of CONDITIONS a line of the table: what it does to the wire, and to the reads. A further condition is a
function and a line there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from random import Random

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import LineSettings
from dissectors.quick_values import quickly_made
from tests.bench.framing_traffic import MS, Said
from tests.bus_delivery import FTDI_LATENCY, ftdi, stalled

NOBODY = -1


@quickly_made
@dataclass(frozen=True, slots=True)
class Octet:
    """One octet on the wire. `end`: ns. `of`: the frame it belongs to, NOBODY for what nobody said.

    `right`: whether it is as it was said. `broken`: whether the line was held low (a break).
    """

    end: int
    value: int
    of: int = NOBODY
    right: bool = True
    broken: bool = False


OnWire = list[Octet]


def laid_out(said: Sequence[Said], line: LineSettings, *, back_to_back: bool = False) -> OnWire:
    """What was said as it stands on the wire; without any pause nobody can have waited for an answer in vain."""
    now, wire = 100 * MS, []
    answered = {frame.answers for frame in said}
    for index, frame in enumerate(said):
        if back_to_back and frame.asks and index not in answered:
            continue
        now += 0 if back_to_back else frame.pause
        for value in frame.octets:
            now += line.char
            wire.append(Octet(now, value, index))
    return wire


def untouched(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
    """Nothing happens."""
    return wire


def junk(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
    """1 to 3 random octets at random places in every silence."""
    return _in_gaps(wire, line, dice, lambda spare, count: sorted(dice.randint(0, spare) for _ in range(count)))


def junk_before(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
    """1 to 3 random octets directly before every frame, as a driver that switches on late makes them."""
    return _in_gaps(wire, line, dice, lambda spare, count: [spare] * count)


def junk_after(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
    """1 to 3 random octets directly after every frame, as a driver that lets go late makes them."""
    return _in_gaps(wire, line, dice, lambda spare, count: [0] * count)


def _in_gaps(wire: OnWire, line: LineSettings, dice: Random, places: Callable[[int, int], list[int]]) -> OnWire:
    char, noisy = line.char, wire[:1]
    for octet in wire[1:]:
        begin = noisy[-1].end
        room = octet.end - char - begin
        count = min(dice.randint(1, 3), room // char)
        if octet.of != noisy[-1].of and count > 0:
            spare = room - count * char
            for number, place in enumerate(places(spare, count), 1):
                noisy.append(Octet(begin + place + number * char, dice.randrange(1 << line.data_bits)))
        noisy.append(octet)
    return noisy


def bit_errors(rate: float) -> Condition:
    """Each data bit inverted with this probability."""

    def strike(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
        struck = []
        for octet in wire:
            mask = sum(1 << bit for bit in range(line.data_bits) if dice.random() < rate)
            struck.append(replace(octet, value=octet.value ^ mask, right=octet.right and not mask))
        return struck

    return strike


def lost(rate: float) -> Condition:
    """Each octet lost with this probability; its time stays empty."""

    def strike(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
        return [octet for octet in wire if dice.random() >= rate]

    return strike


def truncated(rate: float) -> Condition:
    """Of so many frames only a beginning."""

    def strike(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
        kept: OnWire = []
        for octets in _by_frame(wire):
            keep = dice.randrange(1, len(octets)) if len(octets) > 1 and dice.random() < rate else len(octets)
            kept += octets[:keep]
        return kept

    return strike


def bursts(rate: float) -> Condition:
    """So many frames have a stretch of 2 to 12 octets replaced by random ones."""

    def strike(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
        struck: OnWire = []
        for octets in _by_frame(wire):
            if dice.random() < rate:
                begin = dice.randrange(len(octets))
                for at in range(begin, min(len(octets), begin + dice.randint(2, 12))):
                    value = dice.randrange(1 << line.data_bits)
                    octets[at] = replace(octets[at], value=value, right=value == octets[at].value)
            struck += octets
        return struck

    return strike


def breaks(rate: float) -> Condition:
    """After so many frames the line is held low for a character or more."""

    def strike(wire: OnWire, line: LineSettings, dice: Random) -> OnWire:
        struck, ends = [], {octets[-1].end for octets in _by_frame(wire)}
        for at, octet in enumerate(wire):
            struck.append(octet)
            room = wire[at + 1].end - octet.end if at + 1 < len(wire) else 0
            if octet.end in ends and room > 3 * line.char and dice.random() < rate:
                struck.append(Octet(octet.end + dice.randint(line.char, room - 2 * line.char), 0, broken=True))
        return struck

    return strike


def _by_frame(wire: OnWire) -> list[OnWire]:
    frames: list[OnWire] = []
    for octet in wire:
        if frames and frames[-1][-1].of == octet.of:
            frames[-1].append(octet)
        else:
            frames.append([octet])
    return frames


Condition = Callable[[OnWire, LineSettings, Random], OnWire]


def exact(wire: OnWire, line: LineSettings, dice: Random) -> list[Chunk]:
    """One read an octet, at its end."""
    return [Chunk(octet.end, bytes((octet.value,)), _marks(octet)) for octet in wire]


def by_ftdi(wire: OnWire, line: LineSettings, dice: Random) -> list[Chunk]:
    """Through an adapter with a latency timer of 16 ms, which reports no line errors."""
    return ftdi([(octet.end, octet.value) for octet in wire])


def by_busy_host(wire: OnWire, line: LineSettings, dice: Random) -> list[Chunk]:
    """The same, read by a host that in one of ten reads comes up to 60 ms late."""
    return stalled(by_ftdi(wire, line, dice), dice, 0.1, 60 * MS)


def _marks(octet: Octet) -> tuple[Mark, ...]:
    return (Mark(0, LineError.BREAK),) if octet.broken else ()


@dataclass(frozen=True, slots=True)
class Row:
    """One condition of the table. `is_read`: how its octets are read, with the latency (ns) that is told."""

    name: str
    strike: Condition = untouched
    back_to_back: bool = False
    reads: tuple[Callable[[OnWire, LineSettings, Random], list[Chunk]], int] | None = None


BUSY = (by_busy_host, FTDI_LATENCY + 60 * MS)

CONDITIONS = (
    Row("clean"),
    Row("1-3 junk octets a gap", junk),
    Row("1-3 junk directly before", junk_before),
    Row("1-3 junk directly after", junk_after),
    Row("bit errors 1e-4", bit_errors(1e-4)),
    Row("bit errors 1e-3", bit_errors(1e-3)),
    Row("bit errors 3e-3", bit_errors(3e-3)),
    Row("lost octets 3e-3", lost(3e-3)),
    Row("merged reads", reads=BUSY),
    Row("back to back", back_to_back=True),
    Row("truncated 5 %", truncated(0.05)),
    Row("bursts 5 %", bursts(0.05)),
    Row("breaks 20 %", breaks(0.2)),
)
