"""Settings that change within a capture: what was heard before is of the protocol of then."""

from __future__ import annotations

from dissectors.frame import Chunk
from dissectors.line import LineSettings
from sniff.bus.offline import outputs
from sniff.engine.blocks import blocks_of
from sniff.engine.bulk import tables
from sniff.engine.engine import Output
from sniff.engine.session import Item, LineEvent, LineEventKind, Session
from sniff.engine.table import Table

REQUEST = bytes.fromhex("01 03 00 00 00 02 C4 0B")
TOKEN = bytes.fromhex("55 FF 00 05 02 00 00 5B")


def items() -> list[Item]:
    """An RTU request that only the change to MS/TP completes."""
    changes = [
        LineEvent(at, LineEventKind.SETTINGS, f"protocol={name}") for at, name in ((0, "modbus-rtu"), (9, "mstp"))
    ]
    return [changes[0], Chunk(10**7, REQUEST), changes[1], Chunk(10**9, TOKEN)]


def test_tables_say_of_which_protocol_each_frame_is() -> None:
    session = Session("x", LineSettings.parse("38400,8N1"), "mstp")
    made = [one for one in tables(blocks_of(items()), session) if isinstance(one, Table)]
    reference = [one for one in outputs(items(), session) if isinstance(one, Output)]
    expected = [row for one in reference for row in one.rows]
    assert [row for table in made for row in table.rows()] == expected
    assert [row.event.protocol for row in expected] == ["modbus-rtu", "mstp"]  # type: ignore[union-attr]


def test_so_does_a_table_of_what_one_step_gave() -> None:
    session = Session("x", LineSettings.parse("38400,8N1"), "mstp")
    for output in outputs(items(), session):
        if isinstance(output, Output) and output.rows:
            assert list(Table.of_outputs("n2", output.rows[0].no, [output]).rows()) == list(output.rows)
