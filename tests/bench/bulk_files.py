"""Given reads as files, fast: a million of them in a second; and what it costs to read them, whole process.

    python -m tests.bench.bulk_files [READS]        seconds of reading .mcap, .pcap and .pcapng by items and by blocks

Every read is a record of a packet file. Nothing goes through an engine, so frames are what the reads are.
"""

from __future__ import annotations

import json
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np
import numpy.typing as npt

from dissectors.columns import Reads
from dissectors.line import LineSettings
from sniff.engine.session import Session
from sniff.formats.files import NewFile
from sniff.recording.batch import packed
from sniff.recording.batcher import MOST_CHUNKS, MOST_TIME
from sniff.recording.part import PartFile
from sniff.recording.topic_message import Message, stamp
from sniff.recording.topics import RAW

_S = 1_000_000_000
_ROUNDS = 5

Octets = npt.NDArray[np.uint8]
Places = npt.NDArray[np.int64]


def write_mcap(path: Path, reads: Reads, session: Session) -> None:
    """A recording: batches as the recorder cuts them, of at most 256 reads or 0.9 s. Times must not run backwards,
    and no read be over 65535 octets."""
    file = NewFile(path)
    part = PartFile(file.stream, [session])
    begins = reads.begins
    first = 0
    while first < len(reads):
        late = int(np.searchsorted(reads.times, reads.times[first] + MOST_TIME, "right"))
        end = min(first + MOST_CHUNKS, late)
        start, last = int(reads.times[first]), int(reads.times[end - 1])
        steps = (reads.times[first:end] - start).astype("<u4").tobytes()
        sizes = reads.lengths[first:end].astype("<u2").tobytes()
        octets = reads.octets[begins[first] : begins[end]].tobytes()
        data = packed(end - first, start, steps, sizes, [octets])
        part.add(Message(RAW, stamp(last), stamp(start), first % (1 << 32), data))
        if part.waiting > 1 << 20:
            part.flush()
        first = end
    part.finish()
    file.close()


def write_pcap(path: Path, reads: Reads, link_type: int = 165) -> None:
    """A classic pcap file, nanoseconds, little-endian."""
    heads = np.empty((len(reads), 4), "<u4")
    heads[:, 0], heads[:, 1] = reads.times // _S, reads.times % _S
    heads[:, 2] = heads[:, 3] = reads.lengths
    head = struct.pack("<IHHiIII", 0xA1B23C4D, 2, 4, 0, 0, 262_144, link_type)
    path.write_bytes(head + laid(heads.view(np.uint8), reads, 0).tobytes())


def write_pcapng(path: Path, reads: Reads, link_type: int = 165) -> None:
    """A pcapng file of one interface, nanoseconds, little-endian, without comments."""
    padding = -reads.lengths % 4
    heads = np.empty((len(reads), 7), "<u4")
    heads[:, 0], heads[:, 1], heads[:, 2] = 6, 32 + reads.lengths + padding, 0
    heads[:, 3], heads[:, 4] = reads.times >> 32, reads.times & 0xFFFFFFFF
    heads[:, 5] = heads[:, 6] = reads.lengths
    section = struct.pack("<IIIHHqI", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1, 28)
    resolution = struct.pack("<HHB3xHH", 9, 1, 9, 0, 0)
    interface = struct.pack("<IIHHI", 1, 32, link_type, 0, 0) + resolution + struct.pack("<I", 32)
    body = laid(heads.view(np.uint8), reads, padding + 4)
    ends = np.cumsum(28 + reads.lengths + padding + 4)
    sizes = np.ascontiguousarray(heads[:, 1]).view(np.uint8).reshape(-1, 4)
    for at in range(4):
        body[ends - 4 + at] = sizes[:, at]
    path.write_bytes(section + interface + body.tobytes())


def laid(heads: Octets, reads: Reads, behind: Places | int) -> Octets:
    """Each head with its octets behind it, and so many zeros behind those."""
    size = heads.shape[1]
    whole = size + reads.lengths + behind
    begins = np.cumsum(whole) - whole
    whole_of = np.zeros(int(whole.sum()), np.uint8)
    for at in range(size):
        whole_of[begins + at] = heads[:, at]
    before = np.cumsum(reads.lengths) - reads.lengths
    whole_of[np.repeat(begins + size - before, reads.lengths) + np.arange(len(reads.octets))] = reads.octets
    return whole_of


# -- what reading costs ----------------------------------------------------------------------------------------

_READ = """
import json, sys, time
from sniff import formats
begin = time.process_time()
capture = formats.read(sys.argv[1])
reads = octets = 0
if sys.argv[2] == "items":
    for item in capture.items():
        reads += 1
        octets += len(item.octets)
elif sys.argv[2] == "blocks":
    for block in capture.blocks():
        reads += len(block)
        octets += len(block.reads.octets)
import numpy
print(json.dumps([time.process_time() - begin, reads, octets]))
"""
_WAYS = ("items", "blocks")


def _tokens(frames: int) -> Reads:
    """Frames of an MS/TP bus's sizes: tokens and every eighth a longer one; for the cost of reading only."""
    lengths = np.where(np.arange(frames) % 8 == 7, 21 + np.arange(frames) % 13, 8)
    dice = np.random.default_rng(1)
    octets = dice.integers(0, 256, int(lengths.sum()), np.uint8)
    times = 1_772_359_200 * _S + np.cumsum(dice.integers(2_000_000, 12_000_000, frames))
    return Reads(octets, times, lengths, np.zeros(frames, bool))


def main(frames: int) -> None:
    """Print the median of paired rounds, by way and format: whole process, and reading alone."""
    try:
        from tests.bench import bulk_mstp

        reads = bulk_mstp.reads(frames)
    except ImportError:
        reads = _tokens(frames)
    session = Session("/dev/ttyUSB0", LineSettings(38400, 8, "N", 1), "mstp", int(reads.times[0]), "bus")
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        paths = [Path(folder) / f"bus{suffix}" for suffix in (".mcap", ".pcap", ".pcapng")]
        write_mcap(paths[0], reads, session)
        write_pcap(paths[1], reads)
        write_pcapng(paths[2], reads)
        print(f"{len(reads)} reads, {len(reads.octets)} octets; written in {time.perf_counter() - begin:.2f} s")
        for path in paths:
            seconds: dict[str, list[tuple[float, float]]] = {way: [] for way in _WAYS}
            for _ in range(_ROUNDS):
                for way in _WAYS:
                    seconds[way].append(_measured(path, way, reads))
            for way in _WAYS:
                whole, alone = (median(column) for column in zip(*seconds[way], strict=True))
                size = path.stat().st_size
                print(f"{path.suffix:8} {way:7} {whole:6.3f} s process, {alone:6.3f} s CPU reading  ({size} octets)")


def _measured(path: Path, way: str, reads: Reads) -> tuple[float, float]:
    begin = time.perf_counter()
    said = subprocess.run([sys.executable, "-c", _READ, str(path), way], capture_output=True, check=True).stdout
    whole = time.perf_counter() - begin
    alone, count, octets = json.loads(said)
    assert (count, octets) == (len(reads), len(reads.octets))
    return whole, alone


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
