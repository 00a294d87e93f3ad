"""`profile draft` on meters that nobody has described: nearly all is right, and what is not is not said to be sure."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.profiles.model import Entry, Kind, Profile
from dissectors.profiles.packaged import parse_text
from sniff.bus.capture_writer import create
from sniff.engine.session import Session
from tests.sniff.cli.meters import LINE, STATION, Held, Meter, heard, meters

ANSWERS = 120
SEED = 485
METERS = [meter.name for meter in meters(random.Random(SEED))]


def drafted(meter: Meter, folder: Path, sniff485: Callable[..., Any]) -> Profile:
    capture = folder / "meter.mcap"
    with create(capture, Session("meter", LINE, "modbus-rtu", 0)) as writer:
        for chunk in heard(meter, ANSWERS):
            writer.write(chunk)
    ran = sniff485("profile", "draft", capture, "--name", "meter", "--station", STATION)
    assert ran.code == 0, ran.err
    return parse_text(ran.out, "meter.toml")


def is_right(entry: Entry | None, place: int, held: Held, meter: Meter) -> bool:
    if entry is None or entry.address != place:
        return False
    if held.is_still:
        return entry.kind is Kind.U16 and bool(entry.doubt)
    order = entry.kind.registers == 1 or (entry.swapped, entry.little) == (meter.swapped, meter.little)
    return entry.kind is held.kind and order and held.is_written == entry.access.writable


@pytest.mark.parametrize("name", METERS)
def test_a_meter_that_nobody_has_described(name: str, tmp_path: Path, sniff485: Callable[..., Any]) -> None:
    meter = next(meter for meter in meters(random.Random(SEED)) if meter.name == name)
    profile = drafted(meter, tmp_path, sniff485)
    right, wrong = 0, []
    for place, held in meter.places():
        here = [profile.at(meter.table, place + step) for step in range(held.kind.registers)]
        if is_right(here[0], place, held, meter):
            right += held.kind.registers
            continue
        wrong.append((place, held.kind, here))
        assert all(entry is not None and entry.doubt for entry in here), "sure, and wrong"
    total = sum(held.kind.registers for _, held in meter.places())
    assert right >= 0.9 * total, f"{right} of {total}: {wrong}"
