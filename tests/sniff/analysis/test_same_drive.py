"""One drive, asked in every protocol it speaks on a virtual bus: the same values under the same names."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from dissectors.line import LineSettings, Timing
from dissectors.profiles import Devices
from dissectors.profiles.packaged import packaged
from sniff.analysis.point_reader import PointReader
from sniff.analysis.points import PointTable
from sniff.bus.offline import outputs
from sniff.engine.engine import Output
from sniff.engine.follow_settings import dissector_for
from sniff.simulation.scenarios import Scenario, simulate
from sniff.simulation.wire import Party

STATION = 5
MS = 1_000_000
EXPECTED = {
    "set-frequency": (45.0, "Hz"),
    "frequency-command": (45.0, "Hz"),
    "output-frequency": (45.0, "Hz"),
    "output-current": (4.2, "A"),
    "status.running": (1, ""),
    "status.reverse": (1, ""),
    "command.run": (1, ""),
    "command.reverse": (1, ""),
}
RUN_REVERSE, FREQUENCY, CURRENT = 3, 45.0, 4.2


def modbus(line: LineSettings, is_ascii: bool) -> list[Party]:
    from dissectors.modbus.simulated_e510 import SimulatedE510
    from dissectors.modbus.simulated_master import PollingMaster, read_holding

    station = SimulatedE510(STATION, is_ascii=is_ascii)
    station.drive.command_word = RUN_REVERSE
    station.drive.set_point = 4500
    station.drive.output = 4500
    blocks = ((0x2501, 2), (0x2520, 1), (0x2523, 5))
    master = PollingMaster([read_holding(STATION, *block) for block in blocks], line, is_ascii=is_ascii)
    return [Party("master", master, answers=False), Party("drive", station)]


def n2(line: LineSettings) -> list[Party]:
    from dissectors.n2.simulated import Follower, Master, reading

    station = Follower(STATION)
    held = {(3, 1): FREQUENCY, (1, 9): FREQUENCY, (1, 10): FREQUENCY, (1, 11): CURRENT}
    for (region, number), value in {**held, (2, 1): 1, (2, 2): 1, (4, 1): 1, (4, 2): 1}.items():
        station.set(region, number, value)
    places = [*held, (2, 1), (2, 2), (4, 1), (4, 2)]
    master = Master([reading(STATION, *place) for place in places], line=line, delay=20 * MS)
    return [Party("master", master, answers=False), Party("drive", station)]


def mstp(line: LineSettings) -> list[Party]:
    from dissectors.bacnet.f510 import f510
    from dissectors.bacnet.simulated import Poller, SimulatedNode
    from dissectors.bacnet.values import Enumerated, ObjectId

    device = f510(STATION)
    held = {"analog-output,0": FREQUENCY, "analog-input,3": FREQUENCY, "analog-input,4": FREQUENCY}
    held["analog-input,5"] = CURRENT
    on = ("binary-input,0", "binary-input,1", "binary-value,0", "binary-value,1")
    for name, value in {**held, **dict.fromkeys(on, Enumerated(1, "BinaryPV"))}.items():
        device.objects[ObjectId.parse(name)].properties[85] = value
    poller = Poller([(STATION, name, "present-value") for name in (*held, *on)], every=50 * MS)
    timing = Timing(line)
    nodes = (SimulatedNode(1, timing, poller, max_master=8), SimulatedNode(STATION, timing, device, max_master=8))
    return [Party(f"node {number}", node, answers=False) for number, node in enumerate(nodes)]


BUSES: dict[str, tuple[str, Callable[[LineSettings], list[Party]]]] = {
    "modbus-rtu": ("19200,8E1", lambda line: modbus(line, False)),
    "modbus-ascii": ("19200,7E1", lambda line: modbus(line, True)),
    "n2": ("9600,8N1", n2),
    "mstp": ("38400,8N1", mstp),
}


@pytest.mark.parametrize("protocol", BUSES)
def test_the_same_values_under_the_same_names(protocol: str) -> None:
    token, make = BUSES[protocol]
    line = LineSettings.parse(token)
    gap = Timing(line).t35 if protocol == "modbus-rtu" else 0
    plan = Scenario(protocol, protocol, line, lambda: make(line), gap=gap)
    session, items = simulate(plan, 4)
    reader = PointReader(dissector_for(session), Devices({STATION: packaged("teco-f510")}))
    table = PointTable()
    for output in outputs(items, session):
        if isinstance(output, Output):
            table.add(reader.add(output))
    found = {}
    for name in EXPECTED:
        point = table.get(str(STATION), name)
        assert point is not None, name
        found[name] = (point.sample.value.value, point.sample.value.unit)
    assert found == EXPECTED
