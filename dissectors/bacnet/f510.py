"""A simulated TECO F510 drive as its BACnet side is documented (F510 communication addendum, 1.1.4, tables 4.6.4.x).

Quirks kept as printed: model and vendor name as in table 4.6.4.1, objects without Status_Flags, Reliability and
Priority_Array, and the outputs AO1, AO2, AO4 … AO6 read-only. The rows that the table leaves blank although every
device has them (Max_APDU_Length_Accepted, Segmentation_Supported) are answered.
"""

from __future__ import annotations

from dissectors.bacnet.application import Device, Thing, supported, thing
from dissectors.bacnet.values import Enumerated, ObjectId
from dissectors.profiles.packaged import packaged

VENDOR = 461

_DEVICE = 8
_KINDS = {
    "analog-input": 0,
    "analog-output": 1,
    "analog-value": 2,
    "binary-input": 3,
    "binary-output": 4,
    "binary-value": 5,
}
_UNITS = {"Hz": "hertz", "V": "volts", "A": "amperes", "s": "seconds", "hp": "horsepower", "kHz": "kilohertz"}
_NO_UNITS = "no-units"  # as printed, also for the rotation speed

_INITIAL: dict[str, float] = {
    "motor-rated-voltage": 440.0,
    "motor-rated-power": 5.0,
    "motor-rated-speed": 1750.0,
    "motor-rated-frequency": 60.0,
    "motor-rated-current": 7.5,
    "carrier-frequency": 4.0,
    "station-address": 1.0,
    "baud-rate": 2.0,
    "communication-mode": 1.0,
    "run-source": 2.0,
    "frequency-source": 2.0,
    "upper-limit-frequency": 60.0,
    "acceleration-time-1": 10.0,
    "deceleration-time-1": 10.0,
    "pid-gain": 1.0,
    "pid-integral-time": 1.0,
}
"""What a drive holds at first, by point: plausible, not the manual's."""


def f510(instance: int = 1, *, name: str = "TECO F510") -> Device:
    """A drive that stands still, as a device with that instance number."""
    objects: dict[ObjectId, Thing] = {}

    def add(kind: int, number: int, label: str, value: object, **more: object) -> None:
        target = ObjectId(kind, number)
        objects[target] = thing(target, label, value, **more)  # type: ignore[arg-type]

    for entry in packaged("teco-f510").in_space(*_KINDS):
        held: object = float(instance) if entry.name == "device-instance" else _INITIAL.get(entry.name, 0.0)
        limits = {"writable": entry.access.writable, "low": entry.low, "high": entry.high}
        if entry.space.startswith("binary"):
            add(_KINDS[entry.space], entry.address, entry.label, Enumerated(0, "BinaryPV"), **limits)
        else:
            unit = _UNITS.get(entry.unit, _NO_UNITS)
            add(_KINDS[entry.space], entry.address, entry.label, held, units=unit, **limits)
    device = ObjectId(_DEVICE, instance)
    objects[device] = Thing(
        {
            75: device,
            77: name,
            79: Enumerated(_DEVICE, "ObjectType"),
            112: Enumerated(0, "DeviceStatus"),
            121: "TECO F510",
            120: VENDOR,
            70: "TECO.Inc",
            44: "0.14",
            12: "0.14",
            98: 1,
            139: 5,
            97: supported("ServicesSupported", ("read-property", "write-property", "who-is")),
            96: supported(
                "ObjectTypesSupported",
                (
                    "analog-input",
                    "analog-output",
                    "analog-value",
                    "binary-input",
                    "binary-output",
                    "binary-value",
                    "device",
                ),
            ),
            62: 480,
            107: Enumerated(3, "Segmentation"),
            64: 127,
            63: 1,
            58: "R.O.C",
        }
    )
    return Device(instance, objects, VENDOR)
