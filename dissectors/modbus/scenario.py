"""Simulated buses of Modbus: three drives and a master that asks for one more."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from itertools import cycle

from dissectors.line import MS, NS_PER_S, LineSettings, Timing
from dissectors.modbus.envelope import ASCII_NAME, RTU_NAME
from dissectors.modbus.simulated_e510 import SimulatedE510
from dissectors.modbus.simulated_master import PollingMaster, read_holding, write_register, write_registers
from dissectors.simulated import Party, SimulatedBus, no_gap
from dissectors.simulated_faults import BitFlips, Break, EarlyRelease, LateResponse, LostResponse, NoiseInGaps


def rtu_scenarios() -> Mapping[str, SimulatedBus]:
    """Buses of Modbus RTU: as drives are usually polled, and as fast as it goes."""
    return {RTU_NAME: _bus(), f"{RTU_NAME}-busy": _bus(busy=True, line="115200,8E1")}


def ascii_scenarios() -> Mapping[str, SimulatedBus]:
    """The same bus in Modbus ASCII."""
    return {ASCII_NAME: _bus(is_ascii=True)}


def _bus(is_ascii: bool = False, busy: bool = False, line: str = "") -> SimulatedBus:
    return SimulatedBus(
        parties=partial(_parties, is_ascii, busy),
        line=line,
        faults=(
            BitFlips(2e-4),
            EarlyRelease(0.01, ("drive 3",)),
            LostResponse(0.004),
            LateResponse(0.003, 320 * MS),
            NoiseInGaps(0.01),
            Break(0.0005),
        ),
        gap=no_gap if is_ascii else _rtu_gap,
        devices=dict.fromkeys((1, 2, 3), "teco-e510"),
        text="three TECO E510 drives; unit 4 is absent",
        misbehaving="drive 3 lets go of the line too early now and then",
    )


def _rtu_gap(timing: Timing) -> int:
    return timing.t35


def _parties(is_ascii: bool, busy: bool, line: LineSettings, faults: bool) -> list[Party]:
    run, stop, command, frequency, no_such_parameter = 1, 0, 0x2501, 0x2502, 0x0064
    seldom = _InTurn(
        write_registers(1, command, [run, 3_000]),
        write_register(2, frequency, 4_500),
        write_register(2, command, run),
        read_holding(4, 0x2520, 4),  # nobody there
        b"\x03\x08\x00\x00\xa5\x37",  # loopback
        write_registers(3, command, [run, 5_000]),
        read_holding(2, no_such_parameter, 1),
        write_register(1, frequency, 6_000),
        read_holding(1, 0x2520, 16),
        read_holding(4, 0x2520, 4),
        write_register(3, frequency, 1_250),
        write_register(2, 0x2526, 1),  # read only
        write_register(1, command, stop),
        read_holding(2, 0x2510, 2),
        write_register(2, command, stop),
        write_register(0, command, stop),  # to all
    )
    status, speed, dc_bus = (0x2520, 4), (0x2524, 1), (0x2526, 2)
    often = [read_holding(unit, *block) for block in (status, speed, dc_bus) for unit in (1, 2, 3)]
    master = PollingMaster(
        [*often, seldom],
        line,
        is_ascii=is_ascii,
        interval=0 if busy else NS_PER_S,
        pause=2 * MS if busy else 65 * MS,
        timeout=300 * MS,
        retries=1,
    )
    drives = [
        Party(f"drive {unit}", SimulatedE510(unit, is_ascii=is_ascii, delay=MS if busy else delay, ramp=ramp))
        for unit, delay, ramp in ((1, 10 * MS, 1_000), (2, 6 * MS, 2_000), (3, 14 * MS, 400))
    ]
    return [Party("master", master, answers=False), *drives]


class _InTurn:
    """A request of a polling master that is another one each time."""

    def __init__(self, *requests: bytes) -> None:
        self._requests = cycle(requests)

    def __call__(self, now: int) -> bytes:
        return next(self._requests)
