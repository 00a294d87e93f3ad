"""A simulated TECO F510 drive as its BACnet side is documented (F510 communication addendum, 1.1.4, tables 4.6.4.x).

Quirks kept as printed: model and vendor name as in table 4.6.4.1, objects without Status_Flags, Reliability and
Priority_Array, and the outputs AO1, AO2, AO4 … AO6 read-only. The rows that the table leaves blank although every
device has them (Max_APDU_Length_Accepted, Segmentation_Supported) are answered.
"""

from __future__ import annotations

from dissectors.bacnet.application import Device, Thing, supported, thing
from dissectors.bacnet.values import Enumerated, ObjectId

VENDOR = 461

_AI, _AO, _AV, _BI, _BO, _BV, _DEVICE = 0, 1, 2, 3, 4, 5, 8

_HZ, _V, _A, _S, _NONE = "hertz", "volts", "amperes", "seconds", "no-units"

INPUTS: tuple[tuple[str, str, float], ...] = (
    ("TM2 AIN", _V, 0.0),
    ("TM2 AIN2", _V, 0.0),
    ("Error code", _NONE, 0.0),
    ("Freq cmd", _HZ, 0.0),
    ("Frequency", _HZ, 0.0),
    ("Current", _A, 0.0),
    ("Control Mode", _NONE, 0.0),
    ("Motor R-Volt", _V, 440.0),
    ("Motor R-HP", "horsepower", 5.0),
    ("Motor R-RPM", _NONE, 1750.0),
    ("Motor R-Hz", _HZ, 60.0),
    ("CarrierFreq", "kilohertz", 4.0),
    ("Comm Station", _NONE, 1.0),
    ("BaudRate", _NONE, 2.0),
    ("BacnetSel", _NONE, 1.0),
    ("DevInstance", _NONE, 1.0),
)
"""Analog inputs AI0 …: name, unit, value."""

OUTPUTS: tuple[tuple[str, str, float, float | None], ...] = (
    ("Set frequency", _HZ, 0.0, 60.0),
    ("TB2 AO1", _V, 0.0, None),
    ("TB2 AO2", _V, 0.0, None),
    ("Motor R-Amp", _A, 7.5, 65535.0),
    ("PwrL Sel", _NONE, 0.0, None),
    ("RestartSel", _NONE, 0.0, None),
    ("RestartDelay", _S, 0.0, None),
    *((f"FreqCommand{stage}", _HZ, 0.0, 400.0) for stage in range(1, 17)),
    ("RunMode", _NONE, 2.0, 2.0),
    ("ReverseOper", _NONE, 0.0, 1.0),
    ("StoppingSel", _NONE, 0.0, 1.0),
    ("FrequenceComm", _NONE, 2.0, 5.0),
    ("FreqUpperLim", _HZ, 60.0, 400.0),
    ("FreqLowerLim", _HZ, 0.0, 400.0),
    ("Acc Time1", _S, 10.0, 3600.0),
    ("Dec Time1", _S, 10.0, 3600.0),
)
"""Analog outputs AO0 …: name, unit, value, upper limit (None: read-only)."""

GAINS: tuple[tuple[str, float, float], ...] = (
    ("PID – P Gain", 1.0, 10.0),
    ("PID – I Time", 1.0, 100.0),
    ("PID – D Time", 0.0, 10.0),
)
DIGITAL_INPUTS = (
    "Run/Stop",
    "Direction",
    "status",
    "Abnormal",
    "DI_1 status",
    "DI_2 status",
    "DI_3 status",
    "DI_4 status",
    "DI_5 status",
    "DI_6 status",
)
RELAYS = ("RY1 status", "RY2 status", "RY3 status")
COMMANDS = ("RUN/STOP", "FWD/REV")


def f510(instance: int = 1, *, name: str = "TECO F510") -> Device:
    """A drive that stands still, as a device with that instance number."""
    objects: dict[ObjectId, Thing] = {}

    def add(kind: int, number: int, label: str, value: object, **more: object) -> None:
        target = ObjectId(kind, number)
        objects[target] = thing(target, label, value, **more)  # type: ignore[arg-type]

    for number, (label, unit, value) in enumerate(INPUTS):
        add(_AI, number, label, float(instance) if label == "DevInstance" else value, units=unit)
    for number, (label, unit, value, high) in enumerate(OUTPUTS):
        add(_AO, number, label, value, units=unit, writable=high is not None, low=0.0, high=high)
    for number, (label, value, high) in enumerate(GAINS):
        add(_AV, number, label, value, units=_NONE, writable=True, low=0.0, high=high)
    for kind, labels, writable in ((_BI, DIGITAL_INPUTS, False), (_BO, RELAYS, False), (_BV, COMMANDS, True)):
        for number, label in enumerate(labels):
            add(kind, number, label, Enumerated(0, "BinaryPV"), writable=writable, low=0.0, high=1.0)
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
