"""What a filter leaves of a capture: for observers, and as a capture of its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from dissectors.tracker import Transaction
from sniff.bus.offline import settled
from sniff.bus.sifting import Sifted, sift
from sniff.cli import main
from sniff.engine.engine import Output, Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import LineEvent
from sniff.filter import Scope, compile_filter
from sniff.formats import read

CAPTURES = Path(__file__).parents[3] / "captures"
FILTERS = ("dst == 3", "role == response && src == 1", "noise", 'verdict == "no answer"', "no in {20..60}", "len > 500")


class Taken:
    """Everything that is handed on."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.closed: list[Transaction] = []
        self.events: list[LineEvent] = []

    def add(self, output: Output) -> None:
        self.rows += output.rows
        self.closed += output.transactions

    def add_line_event(self, event: LineEvent) -> None:
        self.events.append(event)


@pytest.mark.parametrize("name", ["rtu-usual-faults", "mstp-exceptions", "n2-usual-faults"])
@pytest.mark.parametrize("text", FILTERS)
def test_accepted_rows_and_their_exchanges_are_handed_on(name: str, text: str) -> None:
    capture = read(CAPTURES / f"{name}.cap.txt")
    session = capture.session
    wanted = compile_filter(text, dissector_for(session), Scope(session.started))
    items = [item for item in settled(capture.items(), session) if wanted(item.row, item.transaction)]
    taken, every = Taken(), Taken()
    sift(capture, session, wanted, taken)
    assert taken.rows == [item.row for item in items]
    expected = {item.transaction.id: item.transaction for item in items if item.transaction is not None}
    assert {one.id: one for one in taken.closed} == expected
    assert len(taken.closed) == len(expected)
    sift(capture, session, wanted, every, every_row=True)
    assert [row.no for row in every.rows] == list(range(1, len(every.rows) + 1))
    assert every.closed == taken.closed
    octets = b"".join(getattr(item, "octets", b"") for item in Sifted(capture, session, wanted).items())
    assert octets == b"".join(item.row.event.octets for item in items)


def test_of_a_whole_bus_nothing_is_filtered(capsys: pytest.CaptureFixture[str]) -> None:
    capture = str(CAPTURES / "mstp-exceptions.cap.txt")
    assert main(["stats", capture, "ring", "-Y", "dst == 3"]) == 2
    assert "of a whole bus" in capsys.readouterr().err


def test_only_findings_that_show_such_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    capture = str(CAPTURES / "rtu-usual-faults.cap.txt")
    main(["check", capture, "--json", "-Y", "dst == 2"])
    few = capsys.readouterr().out.splitlines()
    main(["check", capture, "--json"])
    every = capsys.readouterr().out.splitlines()
    assert 0 < len(few) < len(every)
    assert set(few) <= set(every)


@pytest.mark.parametrize("suffix", [".mcap", ".cap.txt", ".pcapng"])
def test_a_part_is_a_capture(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / f"part{suffix}"
    assert main(["convert", str(CAPTURES / "rtu-clean.cap.txt"), str(target), "-Y", "dst == 1"]) == 0
    capsys.readouterr()
    assert main(["show", str(target), "-T", "fields", "-e", "dst"]) == 0
    assert set(capsys.readouterr().out.split()) == {"1"}
