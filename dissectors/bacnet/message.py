"""A whole frame, read layer by layer: MS/TP header, NPDU, APDU, parameters. Total; what is cut off is None."""

from __future__ import annotations

from dataclasses import dataclass

from dissectors.bacnet import apdu as apdus
from dissectors.bacnet import cobs, codec, services
from dissectors.bacnet import npdu as npdus
from dissectors.bacnet.apdu import Apdu
from dissectors.bacnet.frame_types import CARRIES_NPDU, HEADER, data_length, is_encoded
from dissectors.bacnet.npdu import Npdu
from dissectors.frame import Assembly, Check, Damage, Frame
from dissectors.quick_values import quickly_made


@quickly_made
@dataclass(frozen=True, slots=True)
class Message:
    """What a frame says. `data`: the octets it carries, decoded where the type is encoded; b"" when none.

    `npdu`, `apdu`: None where the frame has none or ended before. `parameters`: octets after the APDU header.
    `whole`: the message in segments that the frame ends, header and parameters; None for every other frame.
    """

    frame_type: int
    destination: int
    source: int | None
    length: int | None = None
    data: bytes = b""
    npdu: Npdu | None = None
    apdu: Apdu | None = None
    parameters: bytes = b""
    whole: tuple[Apdu, bytes] | None = None

    def spoken(self) -> tuple[Apdu, bytes] | None:
        """The APDU whose parameters can be read from this frame on, and they: its own, or that of the segments that
        it ends. None for other segments, and where there is none."""
        if self.whole is not None:
            return self.whole
        return None if self.apdu is None or self.apdu.segmented else (self.apdu, self.parameters)


def data_of(octets: bytes) -> bytes | None:
    """The data that a frame's octets carry, without CRC, decoded; None when they are not whole or not decodable."""
    length = data_length(octets)
    if not length:
        return b""
    body = octets[HEADER : HEADER + length + 2]
    if is_encoded(octets[2]):
        return cobs.decode_body(body) if len(body) == length + 2 else None
    return body[:length]


def read(frame: Frame, *, trusting: bool = False) -> Message | None:
    """Read a frame; None when not even its type and destination are there.

    The data of a frame whose check is bad are looked into only when `trusting`, or where it could be put right.
    """
    octets = frame.octets if frame.repair is None else frame.repair.octets
    if len(octets) < 4:
        return None
    source = octets[4] if len(octets) > 4 else None
    if len(octets) < HEADER:
        return Message(octets[2], octets[3], source)
    frame_type, length = octets[2], data_length(octets)
    sound = (
        frame.check is Check.GOOD
        or frame.repair is not None
        or (trusting and frame.damage in (Damage.CHECK, Damage.HEADER))
    )
    data = data_of(octets) if sound else b""
    if not data or frame_type not in CARRIES_NPDU:
        return Message(frame_type, octets[3], source, length, data or b"")
    npdu = npdus.decode(data)
    if npdu is None or npdu.error is not None or npdu.is_network_message:
        return Message(frame_type, octets[3], source, length, data, npdu)
    body = data[npdu.body :]
    apdu = apdus.decode(body)
    rest = body[apdu.body :] if apdu is not None else b""
    whole = _whole(frame.assembly) if frame.assembly is not None else None
    return Message(frame_type, octets[3], source, length, data, npdu, apdu, rest, whole)


def more_follows(frame: Frame) -> bool:
    """Whether it is a segment that is not the last one: within a window nobody need acknowledge it."""
    message = read(frame)
    return message is not None and message.apdu is not None and message.apdu.more_follows


def _whole(assembly: Assembly) -> tuple[Apdu, bytes] | None:
    header = apdus.decode(assembly.octets)
    return None if header is None else (header, assembly.octets[header.body :])


def decode_parameters(apdu: Apdu, parameters: bytes) -> codec.Decoded | None:
    """The parameters of an unsegmented (or gathered) APDU; None where the PDU type has none."""
    if apdu.service is None or apdu.error is not None:
        return None
    return codec.decode(services.parameters(apdu.type, apdu.service), parameters)
