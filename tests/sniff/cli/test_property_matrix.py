"""Which BACnet properties the objects of the TECO drives have, by the tables of both manuals: each asked for."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dissectors.bacnet import apdu, codec, npdu, services
from dissectors.bacnet.packets import MSTP, NPDU

KINDS = (
    "device",
    "analog-input",
    "analog-output",
    "analog-value",
    "binary-input",
    "binary-output",
    "binary-value",
)
OF_ALL = ("object-identifier", "object-name", "object-type")
OF_DEVICE = (
    "system-status", "vendor-name", "vendor-identifier", "model-name", "firmware-revision",
    "application-software-version", "protocol-version", "protocol-revision", "protocol-services-supported",
    "protocol-object-types-supported", "object-list", "max-master", "max-info-frames", "location",
)  # fmt: skip
OF_NOBODY = (
    "max-apdu-length-accepted", "segmentation-supported", "apdu-timeout", "number-of-apdu-retries",
    "device-address-binding", "status-flags", "event-state", "reliability", "out-of-service", "priority-array",
    "relinquish-default", "polarity", "inactive-text", "active-text",
)  # fmt: skip
MATRIX: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(OF_ALL, KINDS),
    **dict.fromkeys(OF_DEVICE, KINDS[:1]),
    **dict.fromkeys(OF_NOBODY, ()),
    "present-value": KINDS[1:],
    "units": KINDS[1:4],
}
"""Property → kinds of objects that have it."""


def request(kind: str, property_name: str) -> bytes:
    about = {"object-identifier": f"{kind},1", "property-identifier": property_name}
    body = codec.encode(services.CONFIRMED[12], about)
    octets = npdu.encode(apdu.encode(0, body, invoke_id=1, service=12, flags=2), expects_reply=True)
    return bytes(MSTP(frame_type=5, destination=1, source=2) / NPDU(octets))


@pytest.mark.parametrize("device", ["teco-e510", "teco-f510"])
def test_what_a_device_does_not_have_is_said_when_it_is_asked_for(
    device: str, sniff485: Callable[..., Any], tmp_path: Path
) -> None:
    asked = [(kind, name) for name in MATRIX for kind in KINDS]
    path = tmp_path / "matrix.cap.txt"
    head = "#!sniff-capture 1\n# line: 38400,8N1\n# protocol: mstp\n# start: 2026-03-01T10:00:00Z\n"
    path.write_text(head + "".join(f"+400 {request(*one).hex(' ')}\n" for one in asked))
    rows = [json.loads(line) for line in sniff485("show", path, "--json", "-d", f"*={device}").out.splitlines()]
    assert len(rows) == len(asked)
    wrong = [
        (kind, name, row["text"])
        for (kind, name), row in zip(asked, rows, strict=True)
        if ("this device has none" in row["text"]) != (kind not in MATRIX[name])
    ]
    assert not wrong
