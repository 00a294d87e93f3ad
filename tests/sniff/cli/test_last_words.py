"""What is said at the end of a capture whose front was too slow to hear its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from dissectors.line import LineSettings
from sniff.analysis.summary import Summary
from sniff.capture.ipc import Ended, Status
from sniff.capture.link import CaptureLink
from sniff.cli.listening import _say_counts, say_recorded
from sniff.engine.session import NO_TIMES, Adapter, Session


@pytest.mark.parametrize("code", [0, 3])
def test_an_end_that_did_not_arrive_says_that_octets_went_with_it(code: int) -> None:
    link: Any = SimpleNamespace(_process=SimpleNamespace(poll=lambda: code))
    ended = CaptureLink._how_it_ended(link)
    assert ended.unheard
    assert ended.lossy == bool(code)


@pytest.mark.parametrize("unheard", [False, True])
def test_octets_that_nobody_counted_are_not_passed_over(unheard: bool, capsys: pytest.CaptureFixture[str]) -> None:
    live: Any = SimpleNamespace(
        status=Status(0, path="x.mcap"),
        ended=Ended("ended", unheard=unheard),
        unseen=0,
        link=SimpleNamespace(paths=["x.mcap"]),
        file_is_gone=False,
    )
    say_recorded(live)
    said = capsys.readouterr().err
    assert ("nobody knows how many" in said) == unheard
    assert "recorded to x.mcap" in said


@pytest.mark.parametrize("has_times", [False, True])
def test_a_file_without_times_that_is_listened_to_has_no_load(
    has_times: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    exact, none = Adapter(latency_from="x"), Adapter(latency_from=NO_TIMES)
    session = Session("p", LineSettings(), "modbus-rtu", adapter=exact if has_times else none)
    printer: Any = SimpleNamespace(live=SimpleNamespace(session=session), summary=Summary(session.line))
    printer.summary.frames = printer.summary.octets = 1
    _say_counts(printer, "")
    said = capsys.readouterr().err
    assert "1 frame (0 damaged), 1 octet" in said
    assert ("load" in said) == has_times
