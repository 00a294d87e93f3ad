"""What is wrong with drives whose profile is known, and what a technician should be told. Data."""

from __future__ import annotations

from functools import partial

from dissectors.modbus.simulated_master import write_register, write_registers
from tests.faults.buses import drives
from tests.faults.case import Case
from tests.faults.stations import Shows

MS = 1_000_000

_too_fast = write_register(2, 0x2502, 65_535)  # 655.35 Hz
_reserved = write_register(2, 0x2508, 1)
_read_only = write_register(2, 0x2524, 1)
_trip = write_register(2, 0x2501, 4)  # external fault
_too_long = write_registers(2, 0x2501, [0] * 40)
_refused = ("station 2",)

DRIVE_CASES: tuple[Case, ...] = (
    Case(
        "drive told too much",
        partial(drives, extra=(_too_fast,)),
        (("PR001", "drive 2"),),
        struck=_refused,
        also=("MB008",),
    ),
    Case(
        "drive, number that its manual has not", partial(drives, numbers=(1, 255)), (("PR012", "drive 255"),), seeds=1
    ),
    Case("drive, reserved register", partial(drives, extra=(_reserved,)), (("PR002", "drive 2"),), struck=_refused),
    Case(
        "drive, read-only register",
        partial(drives, extra=(_read_only,)),
        (("PR003", "drive 2"), ("MB008", "station 2")),  # the device refuses it: no mere "acknowledge"
    ),
    Case("drive trips", partial(drives, extra=(_trip,)), (("PR004", "drive 2"),)),
    Case("drive warns", partial(drives, change={2: partial(Shows, values={0x2528: 9})}), (("PR005", "drive 2"),)),
    Case(
        "drive tells a fault by its status alone",
        partial(drives, change={2: partial(Shows, values={0x2520: 0x0009})}),
        (("PR004", "drive 2"),),
    ),
    Case("drive, frame too long", partial(drives, extra=(_too_long,)), (("PR006", "drive 2"),), struck=_refused),
    Case("drive later than promised", partial(drives, delay=14 * MS), (("PR007", "drive 2"),)),
)
