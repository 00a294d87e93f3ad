"""A paper bus, tracked and judged."""

from __future__ import annotations

from dataclasses import replace

from dissectors.findings import Finding, Severity, with_consequences
from dissectors.frame import Check, Damage, Flaw, Frame, Repair
from dissectors.modbus.envelope import seal_rtu
from dissectors.modbus.header import peek_rtu
from dissectors.modbus.observer import ModbusFindings
from dissectors.modbus.rules import RULES
from dissectors.modbus.tracker import ModbusTracker


def findings_of(bus, is_told: bool = True) -> tuple[Finding, ...]:
    """All findings about what was said on a paper bus, RTU. `is_told`: whether somebody said what adapter it was."""
    timing = replace(bus.timing, is_told=is_told)
    tracker, judge = ModbusTracker(timing), ModbusFindings(timing)
    for no, event in enumerate(bus.events, 1):
        header = peek_rtu(event) if isinstance(event, Frame) else None
        tracked = tracker.track(no, event, header)
        judge.see(no, event, header, tracked.placement)
        for transaction in tracked.closed:
            judge.settle(transaction)
    for transaction in tracker.close():
        judge.settle(transaction)
    return with_consequences(judge.findings(), RULES)


def graves_of(bus) -> set[tuple[str, str]]:
    """Code and subject of what is at warning or above."""
    return {(one.code, one.subject) for one in findings_of(bus) if one.severity >= Severity.WARNING}


def say_damaged(bus, adu: str, flaw: Flaw, gap: float = 8.0):
    """A frame with one flaw, repaired as the framer does."""
    whole = seal_rtu(bytes.fromhex(adu))
    octets = {
        Flaw.CHECK_SWAPPED: whole[:-2] + whole[:-3:-1],
        Flaw.FIRST_MISSING: whole[1:],
        Flaw.FIRST_SPOILT: b"\xfe" + whole[1:],
        Flaw.LAST_MISSING: whole[:-1],
        Flaw.LAST_TWO_MISSING: whole[:-2],
        Flaw.LAST_SPOILT: whole[:-1] + b"\x00",
    }[flaw]
    bus.say(adu, gap)
    good = bus.events.pop()
    short = len(octets) < len(whole)
    bus.events.append(
        replace(
            good,
            octets=octets,
            check=Check.ABSENT if short else Check.BAD,
            damage=Damage.SHORT if short else Damage.CHECK,
            expected=len(whole),
            repair=Repair(flaw, whole),
        )
    )
    return bus
