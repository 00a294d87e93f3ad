"""A recording that grows is read on as it grows: in the end all is as if it were read once."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.line import LineSettings
from sniff.capture.config import SourceSpec
from sniff.capture.process import session_of
from sniff.cli import main
from sniff.engine.session import Item, Session
from sniff.formats import read
from sniff.recording.following import Following
from sniff.recording.mcap_writer import create
from sniff.sources import PortError, open_source
from sniff.sources.clock import Clock

CAPTURE = Path(__file__).parents[3] / "captures" / "rtu-noisy-ftdi.cap.txt"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    assert main(["convert", str(CAPTURE), str(path)]) == 0
    return path


@pytest.mark.parametrize("step", [97, 1500])
def test_wherever_the_file_ends_meanwhile(whole: Path, tmp_path: Path, step: int) -> None:
    octets, grown = whole.read_bytes(), tmp_path / "grown.mcap"
    begin = octets.index(b"recording") + 1000
    grown.write_bytes(octets[:begin])
    following = Following(grown)
    items: list[Item] = list(following.items())
    for end in range(begin, len(octets) + step, step):
        assert not following.ended
        grown.write_bytes(octets[:end])
        items += following.items()
    assert following.ended
    assert items == list(read(str(whole)).items())
    assert list(following.items()) == []


def test_as_a_source_it_waits_and_ends_with_the_file(whole: Path, tmp_path: Path) -> None:
    octets, grown = whole.read_bytes(), tmp_path / "grown.mcap"
    grown.write_bytes(octets[: len(octets) // 2])
    source = open_source(f"follow:{grown}", LineSettings())
    items = source.read()
    assert source.read() == []
    assert not source.ended
    assert source.deadline() is not None
    grown.write_bytes(octets)
    items += source.read()
    assert source.ended
    assert items == list(read(str(whole)).items())
    assert source.now() == items[-1].time


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_bytes(b"no")
    for name in ("x.mcap", "absent.mcap"):
        with pytest.raises(PortError, match=name):
            open_source(f"follow:{tmp_path / name}", LineSettings())


def test_a_capture_of_it_began_when_the_recording_did(tmp_path: Path) -> None:
    """Times since the begin are counted from there, not from when somebody looked."""
    session = Session("/dev/ttyUSB0", LineSettings(), "modbus-rtu", 10**18)
    with create(tmp_path / "night.mcap", session):
        pass
    clock = Clock.start()
    spec = SourceSpec(f"follow:{tmp_path / 'night.mcap'}")
    assert session_of(spec, open_source(spec.spec, spec.line, clock), clock).started == 10**18
