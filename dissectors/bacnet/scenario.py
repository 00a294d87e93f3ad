"""The simulated bus of MS/TP: a ring of four masters."""

from __future__ import annotations

from collections.abc import Mapping

from dissectors.bacnet.f510 import f510
from dissectors.bacnet.simulated import Faults, Poller, SimulatedNode
from dissectors.frame import Place
from dissectors.line import LineSettings, Timing
from dissectors.simulated import Party, SimulatedBus
from dissectors.simulated_faults import BitFlips, Break, CutShort, NoiseInGaps


def scenarios() -> Mapping[str, SimulatedBus]:
    """The one bus, by its name."""
    bus = SimulatedBus(
        parties=_parties,
        faults=(BitFlips(2e-5), CutShort(0.0005), NoiseInGaps(0.002, places=(Place.AFTER,)), Break(0.0002)),
        devices=dict.fromkeys((5, 9), "teco-f510"),
        text="four masters, two of them TECO F510 drives",
        misbehaving="the drive at 9 drops the token now and then",
    )
    return {"mstp": bus}


def _parties(line: LineSettings, faults: bool) -> list[Party]:
    timing = Timing(line)
    drive, fan = 5, 9
    readings = [(mac, f"analog-input,{number}", "present-value") for number in (4, 5, 0, 3) for mac in (drive, fan)]
    controller = Poller([*readings, (drive, "device,5", "object-name"), (fan, "analog-input,99", "present-value")])
    logger = Poller([(drive, "analog-output,0", "present-value"), (fan, "analog-output,0", "present-value")])
    forgetful = Faults(loses_token_every=700, postpones=True) if faults else Faults(postpones=True)
    nodes = {
        "controller": SimulatedNode(1, timing, controller, max_master=31, max_info_frames=2),
        "logger": SimulatedNode(2, timing, logger, max_master=31),
        "drive": SimulatedNode(drive, timing, f510(drive), max_master=127),
        "fan": SimulatedNode(fan, timing, f510(fan, name="fan"), max_master=31, faults=forgetful),
    }
    return [Party(name, node, answers=False) for name, node in nodes.items()]
