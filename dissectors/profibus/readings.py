"""Readings of exchanges: the words of cyclic inputs and outputs, high octet first.

`space` is "dp-input" or "dp-output", `address` the word, from 0. Data of an odd number of octets are told octet by
octet ("dp-input-octet"): only configuration and GSD say what they are. A diagnosis tells "dp-ident" 0.
"""

from __future__ import annotations

from dissectors.frame import Frame
from dissectors.profibus.diagnosis import parse_diagnosis
from dissectors.profibus.header import refusal_words
from dissectors.profibus.services import Service, service_of
from dissectors.profibus.telegram import parse
from dissectors.readings import Origin, Reading


def readings(request: Frame | None, response: Frame | None) -> tuple[Reading, ...]:
    """The outputs that a slave took and the inputs that it gave; without the answer, the outputs that it is given;
    total."""
    if request is None or not request.ok:
        return ()
    asked = parse(request.octets)
    service = service_of(asked)
    if response is None:
        return _words("dp-output", asked.data, Origin.WRITE) if service is Service.DATA_EXCHANGE else ()
    told = parse(response.octets)
    if not response.ok or refusal_words(told) is not None:
        return ()
    if service is Service.DATA_EXCHANGE:
        return (*_words("dp-output", asked.data, Origin.WRITE), *_words("dp-input", told.data, Origin.READ))
    if service is Service.DIAGNOSIS and (said := parse_diagnosis(told.data)) is not None:
        return (Reading("dp-ident", 0, said.ident, said.ident, Origin.READ, words=f"{said.ident:04X}h"),)
    if service is Service.READ_INPUTS:
        return _words("dp-input", told.data, Origin.READ)
    return _words("dp-output", told.data, Origin.READ) if service is Service.READ_OUTPUTS else ()


def _words(space: str, data: bytes, how: Origin) -> tuple[Reading, ...]:
    if len(data) % 2:
        return tuple(Reading(f"{space}-octet", at, octet, octet, how) for at, octet in enumerate(data))
    words = (data[at] << 8 | data[at + 1] for at in range(0, len(data), 2))
    return tuple(Reading(space, at, word, word, how) for at, word in enumerate(words))
