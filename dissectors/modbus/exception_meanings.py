"""What exception codes mean for whoever has to mend something."""

from __future__ import annotations

from dissectors.findings import Severity

EXCEPTIONS: dict[int, tuple[Severity, str, str]] = {
    1: (
        Severity.WARNING,
        "the device does not have this function",
        "the functions in its manual; take the request out of the master's list",
    ),
    2: (
        Severity.WARNING,
        "a register that the device does not have, or a block that runs over the end of its map",
        "the first register and the count; maps in manuals often count from 1, the wire from 0",
    ),
    3: (
        Severity.WARNING,
        "a value or count that the device does not accept",
        "the value written, or the number of registers asked for at once",
    ),
    4: (Severity.ERROR, "the device failed while it did what was asked", "the device's fault memory"),
    5: (Severity.NOTE, "the device takes long for this and will finish later", "whether the master asks again later"),
    6: (Severity.NOTE, "the device is busy", "how often; let the master ask less often"),
    7: (
        Severity.WARNING,
        "the device cannot do what was asked; older Modicon devices say so of programming",
        "the request against the device's manual",
    ),
    8: (Severity.ERROR, "the device found its memory damaged", "whether it comes again; then its maker"),
    10: (Severity.WARNING, "a gateway has no path to the target", "the gateway's routes and port settings"),
    11: (Severity.WARNING, "the device behind a gateway does not answer", "that device: supply, address, wiring"),
}
"""Exception code → severity, what it is consistent with, what to check next."""

USED_ALIKE = (1, 2, 3, 6)
"""Codes of the standard that makers use as the standard does, whatever they call them."""

MAKER_EXCEPTION = (
    Severity.WARNING,
    "the device refuses the request, for the reason that its maker gives for this code",
    "the request against the device's manual: register, count, value, and whether it takes writes now",
)
"""The same for a code that the profile of the device words: the maker may use codes of the standard otherwise."""

VENDOR_EXCEPTION = (
    Severity.WARNING,
    "a refusal with a code of the vendor's own",
    "the code in the device's manual",
)
