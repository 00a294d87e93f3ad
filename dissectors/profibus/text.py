"""One line for the frame list: `2 → 8 Slave_Diag`, `8 → 2 Slave_Diag: not ready, wants parameters; ident F510h`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from dissectors.checksums import sum8
from dissectors.frame import Check, Frame, Header, Role
from dissectors.profibus.configuration import parse_configuration
from dissectors.profibus.control import FDL_STATUS, Control
from dissectors.profibus.diagnosis import NO_MASTER, parse_diagnosis
from dissectors.profibus.dpv1 import parse_acyclic
from dissectors.profibus.header import damage_of, meant, refusal_words
from dissectors.profibus.parameters import parse_global_control, parse_new_address, parse_parameters
from dissectors.profibus.s7 import program_of
from dissectors.profibus.services import ACYCLIC, Service, service_of
from dissectors.profibus.telegram import BROADCAST, Telegram, body_of, parse

if TYPE_CHECKING:
    from dissectors.meaning import Meaning


def text(frame: Frame, header: Header, role: Role) -> str:
    """One line without control characters."""
    telegram = parse(meant(frame))
    return _line(telegram) + _damage(frame)


def line_meant(frame: Frame, header: Header, role: Role, meaning: Meaning) -> str:
    """The same, what it means to its device behind the way it goes: `1 → 5 run, forward — Data_Exchange: out 00 01`."""
    line, said = text(frame, header, role), meaning.about
    telegram = parse(meant(frame))
    if not said or telegram.is_short or telegram.control is None:
        return line
    way = _way(telegram)
    return f"{way} {said} — {line.removeprefix(way).lstrip()}"


def _way(telegram: Telegram) -> str:
    return f"{_station(telegram.source)} → {_station(telegram.destination)}"


def _line(telegram: Telegram) -> str:
    if telegram.is_short:
        return "SC"
    way = _way(telegram)
    if telegram.is_token:
        return f"{way} token"
    if telegram.control is None:
        return f"{way} ?"
    return f"{way} {content(telegram)}{_count(telegram.control)}"


def content(telegram: Telegram) -> str:
    """What a telegram with a frame control octet says."""
    service, control = service_of(telegram), telegram.control
    assert control is not None
    refused = refusal_words(telegram)
    if refused is not None:
        return refused if service is Service.ACKNOWLEDGE else f"{service.title}: {refused}"
    if service is Service.ACKNOWLEDGE:
        station = control.station_type
        return f"{control.words} ({station.words})" if station is not None else control.words
    told = _TOLD.get((service, control.is_request))
    said = told(telegram.data) if told is not None else ""
    if service in ACYCLIC and (pdu := parse_acyclic(telegram.data, control.is_request)) is not None:
        said = pdu.words
    if (program := program_of(telegram)) is not None and service is Service.PROGRAM:
        said = f"{program.words}: {telegram.data.hex(' ')}"
    if service is Service.OTHER:
        points = "" if telegram.dsap is None and telegram.ssap is None else f" SAP {telegram.ssap} → {telegram.dsap}"
        return f"{control.words}{points}" + (f" {telegram.data.hex(' ')}" if telegram.data else "")
    if service is Service.DATA_EXCHANGE and control.status is not None and control.status.is_urgent:
        said += ", diagnosis pending"
    if not said and telegram.data and control.code != FDL_STATUS:
        said = telegram.data.hex(" ")
    return f"{service.title}: {said}" if said else service.title


def _station(address: int | None) -> str:
    return "?" if address is None else "all" if address == BROADCAST else str(address)


def _count(control: Control) -> str:
    """The frame count bit, where it is in use: a repeat shows the same one again."""
    if not control.is_request or control.is_sdn:
        return ""
    if control.fcv:
        return f" [FCB {int(control.fcb)}]"
    return " [first]" if control.fcb else ""


def _diagnosis(data: bytes) -> str:
    said = parse_diagnosis(data)
    if said is None:
        return f"too short: {data.hex(' ')}"
    words = ", ".join(said.status_words) or "nothing to report"
    master = "no master" if said.master == NO_MASTER else f"master {said.master}"
    return "; ".join((words, master, f"ident {said.ident:04X}h", *said.block_words))


def _parameters(data: bytes) -> str:
    said = parse_parameters(data)
    if said is None:
        return f"too short: {data.hex(' ')}"
    parts = [", ".join(said.words) or "no lock", f"ident {said.ident:04X}h"]
    if said.watchdog_words:
        parts.append(f"watchdog {said.watchdog_words}")
    if said.groups:
        parts.append(f"groups {said.groups:02X}h")
    return "; ".join([*parts, f"user {said.user.hex(' ')}"] if said.user else parts)


def _configuration(data: bytes) -> str:
    modules = parse_configuration(data)
    rest = data[modules[-1].end if modules else 0 :]
    words = [module.words for module in modules]
    return "; ".join([*words, f"cut off: {rest.hex(' ')}"] if rest else words) or "none"


def _control(data: bytes) -> str:
    said = parse_global_control(data)
    if said is None:
        return f"too short: {data.hex(' ')}"
    return said.words + (f", groups {said.groups:02X}h" if said.groups else "")


def _new_address(data: bytes) -> str:
    said = parse_new_address(data)
    if said is None:
        return f"too short: {data.hex(' ')}"
    return f"{said.address}, ident {said.ident:04X}h" + (", for good" if said.is_final else "")


def _outputs(data: bytes) -> str:
    return f"out {data.hex(' ')}" if data else "no outputs"


def _inputs(data: bytes) -> str:
    return f"in {data.hex(' ')}" if data else "no inputs"


_TOLD: dict[tuple[Service, bool], Callable[[bytes], str]] = {
    (Service.DIAGNOSIS, False): _diagnosis,
    (Service.SET_PARAMETERS, True): _parameters,
    (Service.CHECK_CONFIGURATION, True): _configuration,
    (Service.GET_CONFIGURATION, False): _configuration,
    (Service.GLOBAL_CONTROL, True): _control,
    (Service.SET_ADDRESS, True): _new_address,
    (Service.DATA_EXCHANGE, True): _outputs,
    (Service.DATA_EXCHANGE, False): _inputs,
    (Service.READ_INPUTS, False): _inputs,
    (Service.READ_OUTPUTS, False): _outputs,
}


def _damage(frame: Frame) -> str:
    words = damage_of(frame)
    if words is None:
        return ""
    if frame.repair is not None:
        return f" [{words}; repaired]"
    if frame.check is Check.BAD and frame.expected == len(frame.octets):
        return f" [{words}: {frame.octets[-2]:02X}, {sum8(body_of(frame.octets)):02X} expected]"
    return f" [{words}]"
