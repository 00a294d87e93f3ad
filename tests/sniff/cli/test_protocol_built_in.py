"""A protocol is one folder and one line: Gong is nowhere but in its folder, and here in the registry."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import strategies as st

from dissectors import registry
from sniff.simulation.scenarios import bursts, scenario
from sniff.testing.crafting import craft
from sniff.testing.framer_contract import framer_contract
from tests.dissectors.gong import framer, seal
from tests.sniff.cli.conftest import Ran

TALK = [(200, b"05r07"), (25, b"05R07012C"), (200, b"05r07"), (1500, b"06w07012C"), (25, b"06W07"), (25, b"06W07")]
"""ms of silence, and what is said: a read, one that is not answered, a write whose answer comes twice."""

CAPTURE = "#!sniff-capture 1\n# line: 9600,7E1\n# protocol: gong\n# start: 2026-03-01T10:00:00Z\n" + "".join(
    f"+{pause} {seal(said).hex(' ')}\n" for pause, said in TALK
)

FRAMES = st.builds(
    lambda station, what, place, value: seal(b"%02X%s%02X%s" % (station, what, place, value)),
    st.integers(0, 255), st.sampled_from([b"r", b"W"]), st.integers(0, 255), st.just(b""),
)  # fmt: skip

TestGongContract = framer_contract(framer, FRAMES, examples=10)


@pytest.fixture
def bell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A capture, and the one line."""
    monkeypatch.setattr(registry, "BUILT_IN", {**registry.BUILT_IN, "gong": "tests.dissectors.gong:GONG"})
    path = tmp_path / "bell.cap.txt"
    path.write_text(CAPTURE)
    return path


def test_its_frames_are_shown_paired_and_filtered(bell: Path, sniff485: Callable[..., Ran]) -> None:
    shown = sniff485("show", bell, "-T", "fields", "-e", "tx.verdict", "-e", "gong.station")
    assert [line.split("\t") for line in shown.out.splitlines()] == [
        ["answered", "5"],
        ["answered", "5"],
        ["no-response", "5"],
        ["answered", "6"],
        ["answered", "6"],
        ["unsolicited", "6"],
    ], shown.err
    named = sniff485("show", bell, "-T", "fields", "-e", "gong.value", "-Y", "gong.value > 0")
    assert named.out.split() == ["300", "300"], named.err


def test_the_other_commands_know_it(bell: Path, sniff485: Callable[..., Ran]) -> None:
    assert "Gong" in sniff485("--help").out
    for command in ("info", "stats", "check", "points"):
        ran = sniff485(command, bell)
        assert ran.code == 0, (command, ran)
    assert "place/7" in sniff485("points", bell).out
    packets, hidden = bell.with_name("bell.pcapng"), bell.with_name("hidden.cap.txt")
    assert sniff485("convert", bell, packets).code == 0
    assert sniff485("show", packets).out.count("read place 7") == 3
    assert sniff485("anonymise", bell, "-o", hidden).code == 0
    assert seal(b"01R07012C").hex(" ").upper() in hidden.read_text().upper()
    assert sniff485("snapshot", bell).code == 0


def test_it_is_crafted_and_simulated(bell: Path) -> None:
    assert craft("gong", body=b"05r07") == b"!05r073E\r"
    assert sum(len(burst.sent) for burst in bursts(scenario("gong", faults=False), 0.99)) == 10
