"""What a session says of its adapter and its line: kept as values, read by nobody out of words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dissectors.line import LineSettings
from sniff.analysis.line_findings import LineFindings
from sniff.engine.event_texts import gone, gone_why
from sniff.engine.session import Adapter, LineEvent, LineEventKind, Session

SESSION = Session("/dev/ttyUSB0", LineSettings.parse("9600,8E1"), "modbus-rtu")


@pytest.mark.parametrize("packets", [True, False, None])
def test_a_file_keeps_whether_a_report_stands_for_a_packet(packets: bool | None) -> None:
    session = replace(SESSION, adapter=Adapter("x", reports=("parity",), packets=packets))
    assert Session.from_metadata(session.to_metadata()) == session


def test_no_word_about_an_adapter_decides_what_its_reports_stand_for() -> None:
    worded = Adapter("x", reports=("parity",), detail="one flag covers a whole packet", packets=False)
    assert not LineFindings(replace(SESSION, adapter=worded))._senders.packets
    assert LineFindings(replace(SESSION, adapter=Adapter("x", reports=("parity",), packets=True)))._senders.packets


def test_why_a_port_went_is_read_back_as_it_was_said() -> None:
    event = LineEvent(1, LineEventKind.UNPLUGGED, gone("/dev/a (b)", "no such device (19)"))
    assert gone_why(event) == "no such device (19)"
    assert gone_why(LineEvent(1, LineEventKind.UNPLUGGED, "simulated")) == "simulated"


def test_a_latency_that_no_adapter_has_is_reckoned_with_all_the_same() -> None:
    said = SESSION.to_metadata() | {"adapter_latency_ns": "9" * 30}
    session = Session.from_metadata(said)
    late = np.array([session.adapter.latency], np.int64) + session.adapter.latency
    assert late[0] == 2 * session.adapter.latency > 0
