"""Segmented messages against two readers of others: tshark gathers the same segments of the same file to the same tree,
bacpypes3 reads the gathered APDU to the same values.

One run of tshark reads requests and answers of 2 … 20 segments in windows of 1 … 8.
"""

from __future__ import annotations

import math
import shutil
import subprocess
from pathlib import Path

import pytest
from bacpypes3.apdu import APDU, ConfirmedRequestPDU, ReadPropertyMultipleACK, ReadPropertyMultipleRequest
from bacpypes3.pdu import PDU

from dissectors.bacnet import MSTP
from dissectors.frame import Frame, Role
from sniff.bus.offline import outputs
from sniff.engine.engine import Output, Row
from sniff.formats import read
from tests.dissectors.bacnet.segmented_bus import (
    READ_MULTIPLE,
    WRITE_MULTIPLE,
    SegmentedBus,
    reads,
    results,
    save,
    writes,
)

TSHARK = shutil.which("tshark")
SEGMENTS = range(2, 21)
WINDOWS = range(1, 9)
COMPARED = (
    "bacapp.type",
    "bacapp.invoke_id",
    "bacapp.confirmed_service",
    "bacapp.fragment",
    "bacapp.fragment.count",
    "bacapp.reassembled.length",
    "bacapp.objectType",
    "bacapp.instance_number",
    "bacapp.property_identifier",
    "bacapp.present_value.real",
)


def _cut(body: bytes, segments: int) -> int | None:
    """The size that makes so many segments; None where none does."""
    size = math.ceil(len(body) / segments)
    return size if math.ceil(len(body) / size) == segments else None


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bus, invoke = SegmentedBus(), 0
    for window in WINDOWS:
        for segments in SEGMENTS:
            invoke += 1
            count = next(n for n in range(20, 60) if _cut(results(n), segments) and _cut(writes(n), segments))
            bus.ask(invoke, READ_MULTIPLE, reads(count))
            bus.answer_in_segments(invoke, READ_MULTIPLE, results(count), _cut(results(count), segments) or 1, window)
            bus.ask_in_segments(invoke, WRITE_MULTIPLE, writes(count), _cut(writes(count), segments) or 1, window)
            bus.reply(invoke, WRITE_MULTIPLE)
    path = tmp_path_factory.mktemp("segments") / "segments.pcap"
    save(path, bus.steps)
    return path


@pytest.fixture(scope="module")
def gathered(capture: Path) -> list[Row]:
    """The rows that hold a whole message."""
    found = read(capture)
    rows = [
        row for output in outputs(found.items(), found.session) if isinstance(output, Output) for row in output.rows
    ]
    return [row for row in rows if isinstance(row.event, Frame) and row.event.assembly is not None]


def test_all_messages_are_whole(gathered: list[Row]):
    assert len(gathered) == 2 * len(SEGMENTS) * len(WINDOWS)
    assert all(isinstance(row.event, Frame) and row.event.assembly and row.event.assembly.complete for row in gathered)


@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
def test_tshark_gathers_the_same_segments_to_the_same_tree(capture: Path, gathered: list[Row]):
    assert TSHARK is not None
    columns = [argument for name in ("frame.number", *COMPARED) for argument in ("-e", name)]
    command = [TSHARK, "-n", "-r", str(capture), "-Y", "bacapp.reassembled.length", "-T", "fields", *columns]
    ran = subprocess.run(command, capture_output=True, timeout=120, check=True)
    theirs = {int(number): cells for number, *cells in (line.split("\t") for line in ran.stdout.decode().splitlines())}
    assert sorted(theirs) == [row.no for row in gathered]
    for row in gathered:
        assert isinstance(row.event, Frame)
        ours = MSTP.fields(row.event, Role.RESPONSE)
        for name, cell in zip(COMPARED, theirs[row.no], strict=True):
            values = [float(value) for value in cell.split(",")] if cell else []
            assert values == [float(value) for value in str(ours.get(name, "")).split(",") if value], (row.no, name)


def test_bacpypes3_reads_the_whole_to_the_same_values(gathered: list[Row]):
    compared = 0
    for row in gathered:
        assert isinstance(row.event, Frame)
        assert row.event.assembly is not None
        apdu = APDU.decode(PDU(row.event.assembly.octets))
        if isinstance(apdu, ConfirmedRequestPDU):
            assert apdu.apduService == WRITE_MULTIPLE
            assert not apdu.apduSeg
            continue
        answer = ReadPropertyMultipleACK.decode(apdu)
        numbers = [int(result.objectIdentifier[1]) for result in answer.listOfReadAccessResults]
        assert numbers == list(range(len(numbers)))
        compared += 1
    assert compared == len(SEGMENTS) * len(WINDOWS)
    assert ReadPropertyMultipleRequest.service_choice == READ_MULTIPLE
