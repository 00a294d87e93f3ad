"""What a rotation cut is whole again: the parts of a recording give what one file would have given, the ring too."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.ring import Ring
from dissectors.bacnet.ring_events import RingEventKind
from dissectors.frame import Chunk, Frame
from sniff.bus.offline import outputs
from sniff.cli import main
from sniff.cli.ring import ring_of
from sniff.engine.capture import Capture
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.formats import read
from sniff.recording.reader import McapCapture
from sniff.recording.rotated import RotatedCapture, joined
from sniff.recording.rotation import Rotation
from sniff.recording.writer import Recorder
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import CH340

STARTED = 1_772_359_200_000_000_000
READS_A_PART = 700


@pytest.fixture(scope="module")
def bus() -> tuple[Session, list[Item]]:
    """14 s of a ring with faults, as a CH340 gives it: reads end inside frames."""
    session, items = simulate(scenario("mstp", 485), 14, CH340, STARTED)
    return session, list(items)


def record(path: Path, session: Session, items: list[Item], rotation: Rotation | None) -> tuple[Path, ...]:
    recorder = Recorder(path, session, rotation)
    for item in items:
        recorder.tick(item.time)
        if isinstance(item, Chunk):
            recorder.chunk(item)
        else:
            recorder.line(item)
    recorder.close()
    assert recorder.trouble is None
    assert recorder.lost_octets == 0
    return recorder.paths


@pytest.fixture(scope="module")
def files(bus: tuple[Session, list[Item]], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Path]]:
    """The same run in one file, and in parts."""
    session, items = bus
    folder = tmp_path_factory.mktemp("rotated")
    (whole,) = record(folder / "whole.mcap", session, items, None)
    parts = record(folder / "parts.mcap", session, items, Rotation(count=READS_A_PART))
    assert len(parts) > 4
    return whole, list(parts)


def as_one(paths: list[Path]) -> Capture:
    ((_, capture),) = joined([(str(path), read(path)) for path in paths])
    return capture


def ring(capture: Capture) -> Ring:
    return ring_of(capture, capture.session, MSTP.ring)


def test_parts_give_the_items_of_the_whole(files: tuple[Path, list[Path]]) -> None:
    whole, parts = files
    assert list(as_one(parts).items()) == list(read(whole).items())
    assert list(as_one(parts[::-1]).items()) == list(read(whole).items())
    assert as_one(parts).completeness().whole
    assert as_one(parts).session.started == STARTED


def test_seams_lie_inside_frames(files: tuple[Path, list[Path]]) -> None:
    """Else the tests here prove nothing: by itself, each part but the first begins or ends with a damaged frame."""
    torn = 0
    for path in files[1]:
        capture = read(path)
        rows = [row for output in outputs(capture.items(), capture.session) if output for row in output.rows]
        torn += not (isinstance(rows[-1].event, Frame) and rows[-1].event.ok)
    assert torn >= 2


def test_the_ring_of_the_parts_is_the_ring_of_the_whole(files: tuple[Path, list[Path]]) -> None:
    """Order, loop and use times, retries per edge, lost tokens, polls, postponed replies: all of it."""
    whole, parts = files
    found = ring(as_one(parts))
    assert found == ring(read(whole))
    assert found.order == (1, 2, 5, 9)
    assert RingEventKind.LOST_TOKEN in {
        what for what, _ in found.happened
    }  # the scenario loses some, but none at a seam
    assert found.masters == (1, 2, 5, 9)


def test_a_ring_observed_on_over_the_seam_adds_up_to_the_counts_of_parts(files: tuple[Path, list[Path]]) -> None:
    """`Ring.merge` of parts read alone: counts add up but for the frames that the seams cut."""
    whole, parts = files
    merged = Ring()
    for path in parts:
        merged = merged.merge(ring(read(path)))
    one = ring(read(whole))
    assert merged.order == one.order
    assert abs(merged.frames - one.frames) <= 2 * len(parts)
    assert set(merged.edges) == set(one.edges)
    lost = sum(happened.count for (what, _), happened in one.happened.items() if what is RingEventKind.LOST_TOKEN)
    assert sum(h.count for (what, _), h in merged.happened.items() if what is RingEventKind.LOST_TOKEN) == lost
    assert not {RingEventKind.LEFT, RingEventKind.TWO_TOKENS} & {what for what, _ in merged.happened}


def test_a_part_that_is_not_given_is_a_hole_and_no_silence(files: tuple[Path, list[Path]]) -> None:
    _, parts = files
    given = [parts[0], *parts[2:]]
    capture = as_one(given)
    (hole,) = [item for item in capture.items() if isinstance(item, LineEvent)]
    assert hole.kind is LineEventKind.DROPPED
    assert capture.completeness().text == "part 2 not given"
    found = ring(capture)
    alone = [ring(read(path)) for path in given]
    for what in (
        RingEventKind.LOST_TOKEN,
        RingEventKind.LATE_USE,
        RingEventKind.LEFT,
        RingEventKind.TWO_TOKENS,
        RingEventKind.NO_REPLY,
        RingEventKind.DAMAGED_REPLY,
    ):
        count = sum(h.count for key, h in found.happened.items() if key[0] is what)
        apart = sum(h.count for one in alone for key, h in one.happened.items() if key[0] is what)
        assert count <= apart, what
    longest = max(node.loop.most or 0 for one in alone for node in one.nodes.values())
    assert max(node.loop.most or 0 for node in found.nodes.values()) <= max(longest, 1_200_000_000)


def test_copies_and_pieces_stay_apart(files: tuple[Path, list[Path]], tmp_path: Path) -> None:
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(files[0].read_bytes())
    opened = [(str(path), read(path)) for path in (files[0], copy, *files[1])]
    names = [name for name, _ in joined(opened)]
    assert names[:2] == [str(files[0]), str(copy)]
    assert len(names) == len(opened)  # the whole and part 1 have one number: nothing says what belongs to what


def test_two_recordings_are_two(
    files: tuple[Path, list[Path]], bus: tuple[Session, list[Item]], tmp_path: Path
) -> None:
    session, items = bus
    later = Session(session.port, session.line, session.protocol, STARTED + 10**12, adapter=session.adapter)
    others = record(tmp_path / "other.mcap", later, items[:5_000], Rotation(count=READS_A_PART))
    mixed = [path for pair in zip(files[1][:2], others[:2], strict=True) for path in pair]
    found = joined([(path.name, read(path)) for path in mixed])
    assert [name for name, _ in found] == ["parts-0001.mcap and 1 more part", "other-0001.mcap and 1 more part"]
    assert all(isinstance(capture, RotatedCapture) for _, capture in found)
    first = found[0][1]
    assert isinstance(first, RotatedCapture)
    assert [part.path for part in first.parts if isinstance(part, McapCapture)] == files[1][:2]


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    def run(*arguments: object) -> str:
        main([str(argument) for argument in arguments])
        return capsys.readouterr().out

    return run


@pytest.mark.parametrize(
    "command",
    [
        ("stats", ..., "ring"),
        ("stats", ..., "nodes"),
        ("stats", ..., "transactions"),
        ("show", ...),
        ("points", ...),
        ("check", "--json", "--fail-on", "never", ...),
    ],
    ids=lambda command: " ".join(str(word) for word in command if word is not ...),
)
def test_commands_say_the_same_of_the_parts(
    files: tuple[Path, list[Path]], said: Callable[..., str], command: tuple[object, ...]
) -> None:
    whole, parts = files
    at = command.index(...)
    of_parts = said(*command[:at], *parts, *command[at + 1 :])
    of_whole = said(*command[:at], whole, *command[at + 1 :])
    if command[0] == "check":
        assert [_without_source(line) for line in of_parts.splitlines()] == [
            _without_source(line) for line in of_whole.splitlines()
        ]
    else:
        assert of_parts == of_whole
    assert of_parts


def _without_source(line: str) -> object:
    return {key: value for key, value in json.loads(line).items() if key not in ("file", "source")}
