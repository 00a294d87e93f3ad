"""Devices are judged by their profiles from tables as they are row by row, wherever the tables are cut."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest

from dissectors.findings import Finding
from dissectors.frame import Chunk
from dissectors.line import Timing
from dissectors.manifest import Dissector
from dissectors.modbus.envelope import seal_rtu
from dissectors.profiles import Devices
from dissectors.profiles.model import Access, EntryRole
from dissectors.profiles.packaged import packaged
from dissectors.row_columns import in_turn
from sniff.analysis import bulk_profile_findings, point_reader
from sniff.analysis.bulk_profile_findings import BulkProfileFindings
from sniff.analysis.point_reader import PointReader, Sample
from sniff.analysis.profile_findings import ProfileFindings
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.table import Table
from sniff.simulation.scenarios import scenario, simulate
from tests.property.test_judging_tables import MIXED, cut
from tests.seeds import seeds
from tests.sniff.analysis import points_bus as bus

MS = 1_000_000
ACN = packaged("automationdirect-acn")
NO_COMMAND = replace(
    ACN,
    entries=tuple(replace(one, role=EntryRole.VALUE) if one.access is Access.STOPPED else one for one in ACN.entries),
)
"""The same drive, if what it takes only while it stands were no command."""

DRIVES = Devices(
    {
        1: NO_COMMAND,
        2: packaged("teco-e510"),
        3: packaged("teco-f510"),
        250: packaged("teco-e510"),
    }
)

OFTEN = (
    ("010303040001", "010302{1}"),  # of an ACN, which may say that it runs
    ("020325200001", "020302{0}"),
    ("020325240001", "020302{0}"),
    ("020325210004", "020308{0}0000{1}{0}"),
    ("030325210001", "030302{0}"),
    ("040325200001", "040302{0}"),  # no profile is known of it
)
SELDOM = (
    *(("010603810002", "010603810002"),) * 4,  # it is told to stop
    *(("010603df0001", "010603df0001"),) * 4,  # taken while it stands
    ("010603100001", "010603100001"),
    ("02062501{0}", "02062501{0}"),
    ("020625080001", "020625080001"),
    ("020625090001", "028604"),
    ("000625013001", None),
    ("020325200001", "028306"),
    ("020425200001", "028401"),
    ("fa0325200001", "fa0302{0}"),  # no number that its manual has
    ("0217252000012501000102{0}", "021702{0}"),
)
STATES = ("0031", "0031", "0000")
VALUES = ("0000", "0001", "0003", "0012", "8000", "ffff")


def conversation(dice: random.Random, many: int) -> Iterator[Chunk]:
    """Exchanges of drives; some slow, some given up and answered late, some sent again, some damaged."""
    now = bus.MS
    for _ in range(many):
        request, response = dice.choice(OFTEN if dice.random() < 0.8 else SELDOM)
        words = dice.choice(VALUES), dice.choice(STATES)
        latency = dice.choice((8, 8, 8, 8, 30, 95))
        sent = [(request, 50)]
        if dice.random() < 0.05:
            sent += [(request, 200)]
        if response is not None and dice.random() < 0.95:
            sent += [(response, latency)]
        else:
            sent += [(None, 200)]
            if response is not None and dice.random() < 0.5:  # it comes behind the next request's answer, or at once
                sent += [(response, 20)]
        for told, pause in sent:
            now += pause * MS
            if told is None:
                continue
            octets = bytearray(seal_rtu(bytes.fromhex(told.format(*words))))
            if dice.random() < 0.02:
                octets[dice.randrange(len(octets))] ^= 1 << dice.randrange(8)
            now += len(octets) * bus.LINE.char
            yield Chunk(now, bytes(octets))


def by_rows(tables: list[Table], timing: Timing, dissector: Dissector, devices: Devices) -> tuple[Finding, ...]:
    judge = ProfileFindings(timing, dissector, devices)
    for table in tables:
        in_turn(judge, table)
    return judge.findings()


def by_tables(
    tables: list[Table], timing: Timing, dissector: Dissector, devices: Devices, dice: random.Random, most: int
) -> tuple[Finding, ...]:
    judge = BulkProfileFindings(timing, dissector, devices)
    for table in tables:
        for part in cut(table, dice, most):
            judge.take(part)
    return judge.findings()


@cache
def drives(seed: int) -> tuple[Timing, Dissector, list[Table]]:
    items = list(outputs(conversation(random.Random(seed), 400), bus.SESSION))
    told = [one for one in items if isinstance(one, Output)]
    return bus.SESSION.timing, dissector_for(bus.SESSION), [Table.of_outputs("modbus-rtu", 1, told)]


@pytest.mark.parametrize("seed", seeds(40, 4))
@pytest.mark.parametrize("most", [1 << 30, MIXED, 3])
def test_drives_are_judged_from_tables_as_row_by_row(seed: int, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    timing, dissector, tables = drives(seed)
    expected = by_rows(tables, timing, dissector, DRIVES)
    assert by_tables(tables, timing, dissector, DRIVES, random.Random(seed), most) == expected
    monkeypatch.setattr(bulk_profile_findings, "MOST_KNOWN", 3)
    assert by_tables(tables, timing, dissector, DRIVES, random.Random(seed), most) == expected


def test_the_drives_say_a_lot() -> None:
    """Else they would show little."""
    found = {one.code for seed in range(4) for one in by_rows(*(drives(seed)[at] for at in (2, 0, 1)), DRIVES)}
    assert found >= {"PR001", "PR002", "PR003", "PR004", "PR007", "PR008", "PR009", "PR013"}


@pytest.mark.parametrize("name", ["n2", "mstp", "modbus-ascii"])
def test_simulated_devices_are_judged_from_tables_as_row_by_row(name: str) -> None:
    plan = scenario(name)
    session, chunks = simulate(plan, 60 if name == "n2" else 10)
    told = [one for one in outputs(chunks, session) if isinstance(one, Output)]
    tables = [Table.of_outputs(session.protocol, 1, told)]
    devices = Devices({address: packaged(profile) for address, profile in plan.devices.items()})
    about = session.timing, dissector_for(session), devices
    expected = by_rows(tables, *about)
    assert expected or name == "mstp"
    assert by_tables(tables, *about, random.Random(1), MIXED) == expected


def test_what_was_heard_before_is_not_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A night of polls whose answers were heard before costs no values."""
    session: Session = replace(bus.SESSION)
    exchanges = (("020325200001", "0203020000"), ("020325210001", "0203020000")) * 50
    told = [one for one in outputs(bus.chunks(*exchanges), session) if isinstance(one, Output)]
    table, seen = Table.of_outputs("modbus-rtu", 1, told), []
    see = ProfileFindings.see
    monkeypatch.setattr(ProfileFindings, "see", lambda self, *row: (seen.append(row), see(self, *row)))
    judge = BulkProfileFindings(session.timing, dissector_for(session), DRIVES)
    judge.take(table)
    assert len(seen) == 4


@pytest.mark.parametrize("held", [3, 40, 1 << 16])
def test_values_that_were_heard_before_are_the_same(held: int, monkeypatch: pytest.MonkeyPatch) -> None:
    _, dissector, (table,) = drives(0)

    def samples(most: int) -> list[Sample]:
        monkeypatch.setattr(point_reader, "MOST_HEARD", most)
        reader = PointReader(dissector, DRIVES)
        return [sample for output in table.outputs() for sample in reader.add(output)]

    assert samples(held) == samples(-1)  # nothing is kept
