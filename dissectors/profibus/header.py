"""The quick look at a telegram.

`function` is the function code, of requests and answers alike; `address` the service access point of the slave, where
one is named; `count` the octets of data. A short acknowledgement names nobody: the tracker knows whose it is.
"""

from __future__ import annotations

from dissectors.frame import Check, Damage, Frame, Header, Role
from dissectors.profibus.control import Control
from dissectors.profibus.services import Service, service_of, slave_sap
from dissectors.profibus.telegram import BROADCAST, Telegram, parse

DAMAGES: dict[Damage, str] = {
    Damage.CHECK: "wrong FCS",
    Damage.SHORT: "too short",
    Damage.LONG: "too long",
    Damage.FORM: "wrong start, end, frame control or parity",
    Damage.HEADER: "wrong length",
    Damage.TIMEOUT: "no end, silence",
    Damage.RESTARTED: "no end, another telegram began",
}


def meant(frame: Frame) -> bytes:
    """The octets of a frame; of a damaged one what they were, where one thing put right shows it."""
    return frame.octets if frame.repair is None else frame.repair.octets


def damage_of(frame: Frame) -> str | None:
    """What is wrong with the frame itself, in words; None when nothing is."""
    if frame.repair is not None:
        return frame.repair.flaw.value
    if frame.damage is not None:
        return DAMAGES[frame.damage]
    return "wrong FCS" if frame.check is Check.BAD else None


def peek(frame: Frame) -> Header:
    """What a telegram is, from whom, to whom; total."""
    telegram, damage = parse(meant(frame)), damage_of(frame)
    error = damage if damage is not None else refusal_words(telegram)
    return Header(
        protocol="profibus",
        source=telegram.source,
        destination=telegram.destination,
        role=_role(telegram),
        kind=service_of(telegram).value,
        function=None if telegram.control is None else telegram.control.code,
        address=slave_sap(telegram) if telegram.control is not None else None,
        count=len(telegram.data) if telegram.control is not None else None,
        ok=damage is None,
        error=error,
    )


def refusal_words(telegram: Telegram) -> str | None:
    """With what an answer refuses the request, in words; None where it does not."""
    status = None if telegram.control is None else telegram.control.status
    return f"{status.words} ({status.short})" if status is not None and status.refuses else None


def _role(telegram: Telegram) -> Role:
    if telegram.is_token:
        return Role.TOKEN
    if telegram.is_short:
        return Role.RESPONSE
    control = telegram.control
    if control is None:
        return Role.UNKNOWN
    if not control.is_request:
        return Role.RESPONSE
    if service_of(telegram) is Service.FDL_STATUS:
        return Role.POLL
    if telegram.destination == BROADCAST:
        return Role.BROADCAST
    return Role.REQUEST if _wants_answer(control) else Role.DATA


def _wants_answer(control: Control) -> bool:
    return control.wants_answer or not control.is_known
