"""A tap: what a sniffer behind a serial adapter would have read of a simulated line. Bursts in, chunks and events out.

Pure. An octet's way, and where it is held back:

    line ──► adapter's buffer ──► USB frame ──► host wakes the reader ──► one read = one Chunk
             until `packet` octets, the       next multiple     0 … `jitter`; what arrives
             latency `timer`, or `idle`       of `usb_frame`    meanwhile is merged into it
             characters of silence

Every octet is read at most `TapModel.latency` after its end, so a session with that latency claims only what is true.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from random import Random

from dissectors.frame import Chunk, LineError, Mark
from dissectors.line import MS, LineSettings
from sniff.engine.session import Adapter, Item, LineEvent, LineEventKind
from sniff.simulation.wire import Burst


@dataclass(frozen=True, slots=True)
class TapModel:
    """An adapter and its host, as far as they bend time.

    `timer`: latency timer, ns, free-running from packet to packet; 0 for none. `packet`: octets that fill a packet.
    `idle`: characters of silence after which octets are handed on (a UART's FIFO timeout); 0 for none. With neither,
    each run of octets is read as its last one ends.
    `usb_frame`: ns between the moments at which the host asks. `jitter`: most ns until the reader wakes.
    `cut`: probability that a read returns only a part: with a timer the rest follows at once, without one when it ends.
    `reports`: line errors that it can tell. `whole_packet`: an error is put on every octet of its packet (FTDI).
    `ambiguous`: parity and framing errors cannot be told apart (Linux PARMRK).
    `unplugged`: times (from, to), ns, in which there is no adapter.
    """

    name: str = "exact"
    timer: int = 0
    packet: int = 4096
    idle: int = 0
    usb_frame: int = 0
    jitter: int = 0
    cut: float = 0.0
    reports: tuple[str, ...] = ("parity", "framing", "break")
    whole_packet: bool = False
    ambiguous: bool = False
    unplugged: tuple[tuple[int, int], ...] = ()

    def latency(self, line: LineSettings) -> int:
        """Most ns between the end of an octet and its read."""
        held = self.timer or min(self.packet * self.idle, 1 << 20) * line.char
        return held + self.usb_frame + self.jitter + (_CUT_APART if self.cut and self.timer else 0)

    def adapter(self, line: LineSettings) -> Adapter:
        """The adapter as a session describes it."""
        return Adapter(
            f"simulated {self.name}",
            "simulated",
            self.latency(line),
            "simulated",
            self.reports,
            "one flag covers a whole packet" if self.whole_packet else "",
            packets=self.whole_packet,
        )


_CUT_APART = 200_000  # most ns between the parts of a cut read

EXACT = TapModel()
OCTETS = TapModel("octet by octet", packet=1)
FTDI = TapModel("FTDI 16 ms", timer=16 * MS, packet=62, usb_frame=MS, jitter=MS // 2, whole_packet=True, ambiguous=True)
FTDI_LOW_LATENCY = TapModel("FTDI 1 ms", MS, 62, usb_frame=MS, jitter=MS // 2, whole_packet=True, ambiguous=True)
CH340 = TapModel("CH340", timer=MS, packet=32, usb_frame=MS, jitter=MS // 2, reports=())
UART = TapModel("16550 UART", packet=8, idle=4, jitter=MS // 5, ambiguous=True)

MODELS = {
    "exact": EXACT,
    "octets": OCTETS,
    "ftdi": FTDI,
    "ftdi-low-latency": FTDI_LOW_LATENCY,
    "ch340": CH340,
    "uart": UART,
}


class Tap:
    """Turns the bursts of one line into what one adapter's reader gets, in order of time."""

    def __init__(self, line: LineSettings, model: TapModel = EXACT, seed: int = 0) -> None:
        self._line = line
        self._model = model
        self._dice = Random(f"{seed} tap")
        self._octets = bytearray()  # in the adapter
        self._marks: list[Mark] = []
        self._last_end = 0
        self._tick = 0  # when the latency timer expires next
        self._read = bytearray()  # at the host, not yet read
        self._read_marks: list[Mark] = []
        self._read_at = 0
        self._last_read = 0
        self._unplugged = sorted(model.unplugged)
        self._out: list[Item] = []

    def tap(self, bursts: Iterable[Burst]) -> Iterator[Item]:
        """All of it, to the end."""
        for burst in bursts:
            yield from self.feed(burst)
        yield from self.close()

    def feed(self, burst: Burst) -> list[Item]:
        """Take the next burst; give the reads that are complete."""
        if self._unplugged:
            self._plug(burst.start)
            if self._unplugged and self._unplugged[0][0] <= burst.end:
                return self._take()  # octets of a burst that meets the absence are gone
        if burst.octets:
            self._collect(burst)
        return self._take()

    def close(self) -> list[Item]:
        """End of the run: everything still held."""
        self._flush(self._due())
        self._hand_over()
        for _, back in self._unplugged:
            self._plug(back)
        return self._take()

    def _collect(self, burst: Burst) -> None:
        """Put octets into the adapter's buffer, flushing where the timer or a full packet says so."""
        ends, count, model = burst.ends, len(burst.octets), self._model
        marks = [m for m in (self._reported(mark) for mark in burst.marks) if m is not None]
        begin = 0
        while begin < count:
            first = ends[begin]
            if self._octets and self._due() < first:
                self._flush(self._due())
            if model.timer and not self._octets and self._tick < first:
                self._tick += -(-(first - self._tick) // model.timer) * model.timer  # empty packets tick on
            end = min(self._run(burst, begin), begin + model.packet - len(self._octets))
            cut = not model.timer and self._cuts(end - begin)
            if cut:
                end = begin + cut
            if marks:
                shift = len(self._octets) - begin
                self._marks += [Mark(m.offset + shift, m.error) for m in marks if begin <= m.offset < end]
            self._octets += burst.octets[begin:end]
            self._last_end = ends[end - 1]
            if cut or len(self._octets) >= model.packet:
                self._flush(self._last_end)
            begin = end

    def _run(self, burst: Burst, begin: int) -> int:
        """Offset after the last octet from `begin` on that arrives before the adapter hands on what it has."""
        ends, count = burst.ends, len(burst.octets)
        if self._model.timer:
            return max(begin + 1, bisect_right(ends, self._tick, begin, count))
        if isinstance(ends, range):  # back to back
            return count
        longest = (1 + self._model.idle) * self._line.char
        for place in range(begin + 1, count):
            if ends[place] - ends[place - 1] > longest:
                return place
        return count

    def _due(self) -> int:
        """When the adapter hands on what it holds."""
        if self._model.timer:
            return self._tick
        return self._last_end + self._model.idle * self._line.char

    def _flush(self, time: int) -> None:
        """The adapter makes a packet of what it holds, and the host gets it."""
        model = self._model
        if model.timer:
            self._tick = time + model.timer
        if not self._octets:
            return
        frame = model.usb_frame
        arrival = -(-time // frame) * frame if frame else time
        if self._read and arrival > self._read_at:
            self._hand_over()
        if not self._read:
            self._read_at = arrival + (self._dice.randrange(model.jitter) if model.jitter else 0)
        marks = self._marks
        if marks and model.whole_packet:
            error = marks[0].error
            for mark in marks[1:]:
                error |= mark.error
            marks = [Mark(offset, error) for offset in range(len(self._octets))]
        shift = len(self._read)
        self._read_marks += [Mark(shift + mark.offset, mark.error) for mark in marks]
        self._read += self._octets
        self._octets.clear()
        self._marks = []

    def _hand_over(self) -> None:
        """The reader gets what is there."""
        if not self._read:
            return
        octets, marks, time = bytes(self._read), tuple(self._read_marks), max(self._read_at, self._last_read)
        self._read.clear()
        self._read_marks = []
        if self._model.timer and (cut := self._cuts(len(octets))):
            self._out.append(Chunk(time, octets[:cut], tuple(m for m in marks if m.offset < cut)))
            octets, marks = octets[cut:], tuple(Mark(m.offset - cut, m.error) for m in marks if m.offset >= cut)
            time += self._dice.randrange(_CUT_APART)
        self._out.append(Chunk(time, octets, marks))
        self._last_read = time

    def _cuts(self, count: int) -> int:
        """After how many of `count` octets a read is cut; 0 for not at all."""
        if not self._model.cut or count < 2 or self._dice.random() >= self._model.cut:
            return 0
        return self._dice.randrange(1, count)

    def _take(self) -> list[Item]:
        out, self._out = self._out, []
        return out

    def _reported(self, mark: Mark) -> Mark | None:
        """A mark as the adapter reports it, None where it cannot."""
        told = LineError(0)
        for error in mark.error:
            if (error.name or "").lower() in self._model.reports:
                told |= error
        if self._model.ambiguous and told & (LineError.PARITY | LineError.FRAMING):
            told |= LineError.PARITY | LineError.FRAMING
        return Mark(mark.offset, told) if told else None

    def _plug(self, time: int) -> None:
        """Say which absences of the adapter are over at `time`."""
        while self._unplugged and self._unplugged[0][1] <= time:
            gone, back = self._unplugged.pop(0)
            self._flush(min(gone, self._due()))
            self._hand_over()
            self._out.append(LineEvent(gone, LineEventKind.UNPLUGGED, "simulated"))
            self._out.append(LineEvent(back, LineEventKind.REPLUGGED, "simulated"))
