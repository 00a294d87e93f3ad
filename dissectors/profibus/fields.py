"""The fields of a telegram by name, for filters and JSON. Wireshark has no PROFIBUS FDL, so all names are ours.

pb.sd  pb.le  pb.da  pb.sa  pb.fc  pb.request  pb.function  pb.function.name  pb.fcb  pb.fcv  pb.status
pb.station_type  pb.dsap  pb.ssap  pb.service  pb.data  pb.fcs  pb.fcs.status
pb.diag.status  pb.diag.words  pb.diag.master  pb.diag.ident  pb.diag.<each bit by name>  pb.diag.blocks
pb.diag.module  pb.diag.channel  pb.diag.error (of the first channel)  pb.diag.extended
pb.v1.function  pb.v1.function.name  pb.v1.slot  pb.v1.index  pb.v1.length  pb.v1.data  pb.v1.error  pb.malformed
pb.prm.status  pb.prm.words  pb.prm.watchdog_ms  pb.prm.tsdr  pb.prm.ident  pb.prm.groups  pb.prm.user
pb.cfg  pb.cfg.words  pb.cfg.inputs  pb.cfg.outputs  pb.cfg.modules  pb.gc.command  pb.gc.words  pb.gc.groups
pb.new_address  pb.new_address.ident
"""

from __future__ import annotations

from dissectors.findings import counted
from dissectors.frame import Check, Frame, Role
from dissectors.profibus.configuration import parse_configuration
from dissectors.profibus.control import Control
from dissectors.profibus.diagnosis import DIAGNOSIS_BITS, STANDARD, parse_blocks, parse_diagnosis
from dissectors.profibus.dpv1 import parse_acyclic
from dissectors.profibus.header import meant
from dissectors.profibus.parameters import LEAST, parse_global_control, parse_new_address, parse_parameters
from dissectors.profibus.services import ACYCLIC, Service, service_of
from dissectors.profibus.telegram import SD2, Telegram, parse

Fields = dict[str, int | float | str]

CHECK_STATUS = {Check.BAD: 0, Check.GOOD: 1, Check.ABSENT: 3}
"""Wireshark's numbers for a checksum: 0 bad, 1 good, 3 not present."""


def fields(frame: Frame, role: Role) -> Fields:
    """Field names to values, in frame order; total. A repaired frame gives what it was."""
    octets = meant(frame)
    telegram = parse(octets)
    found: Fields = {"pb.sd": telegram.start}
    if telegram.start == SD2 and len(octets) > 1:
        found["pb.le"] = octets[1]
    if telegram.destination is not None:
        found["pb.da"] = telegram.destination
    if telegram.source is not None:
        found["pb.sa"] = telegram.source
    if telegram.control is not None:
        found |= _control(telegram.control)
    if telegram.dsap is not None:
        found["pb.dsap"] = telegram.dsap
    if telegram.ssap is not None:
        found["pb.ssap"] = telegram.ssap
    found["pb.service"] = service_of(telegram).value
    if telegram.data:
        found["pb.data"] = telegram.data.hex(" ")
        found |= _content(telegram)
    if telegram.control is not None and frame.check is not Check.ABSENT and len(octets) > 1:
        found["pb.fcs"] = octets[-2]
    found["pb.fcs.status"] = CHECK_STATUS[frame.check]
    return found


def _control(control: Control) -> Fields:
    found: Fields = {
        "pb.fc": control.octet,
        "pb.request": int(control.is_request),
        "pb.function": control.code,
        "pb.function.name": control.words,
    }
    if control.is_request:
        return {**found, "pb.fcb": int(control.fcb), "pb.fcv": int(control.fcv)}
    if control.status is not None:
        found["pb.status"] = control.status.short
    if control.station_type is not None:
        found["pb.station_type"] = control.station_type.value
    return found


def _content(telegram: Telegram) -> Fields:
    service, data = service_of(telegram), telegram.data
    if service is Service.DIAGNOSIS and not telegram.is_request:
        return _diagnosis(data)
    if service is Service.SET_PARAMETERS and telegram.is_request:
        return _parameters(data)
    if service is Service.CHECK_CONFIGURATION or (service is Service.GET_CONFIGURATION and not telegram.is_request):
        modules = parse_configuration(data)
        cut = {"pb.malformed": "configuration cut off"} if (modules[-1].end if modules else 0) < len(data) else {}
        return {
            **cut,
            "pb.cfg": data.hex(" "),
            "pb.cfg.words": "; ".join(module.words for module in modules),
            "pb.cfg.inputs": sum(module.inputs for module in modules),
            "pb.cfg.outputs": sum(module.outputs for module in modules),
            "pb.cfg.modules": len(modules),
        }
    if service in ACYCLIC:
        return _acyclic(data, telegram.is_request)
    if not telegram.is_request:
        return {}
    if service is Service.GLOBAL_CONTROL:
        if (control := parse_global_control(data)) is None:
            return _short(service, data, 2)
        return {"pb.gc.command": control.command, "pb.gc.words": control.words, "pb.gc.groups": control.groups}
    if service is Service.SET_ADDRESS:
        if (new := parse_new_address(data)) is None:
            return _short(service, data, 4)
        return {"pb.new_address": new.address, "pb.new_address.ident": new.ident}
    return {}


def _short(service: Service, data: bytes, least: int) -> Fields:
    return {"pb.malformed": f"{service.title}: {counted(len(data), 'octet')}, {least} expected"}


def _acyclic(data: bytes, is_request: bool) -> Fields:
    said = parse_acyclic(data, is_request)
    if said is None:
        return {"pb.malformed": "no function of DP-V1"}
    found: Fields = {"pb.v1.function": said.function, "pb.v1.function.name": said.name}
    numbers = (("pb.v1.slot", said.slot), ("pb.v1.index", said.index), ("pb.v1.length", said.length))
    found |= {name: value for name, value in numbers if value is not None}
    if said.data:
        found["pb.v1.data"] = said.data.hex(" ")
    if said.error is not None:
        found["pb.v1.error"] = said.error
    return {**found, "pb.malformed": "DP-V1: cut off"} if said.is_cut else found


def _diagnosis(data: bytes) -> Fields:
    said = parse_diagnosis(data)
    if said is None:
        return _short(Service.DIAGNOSIS, data, STANDARD)
    found: Fields = {
        "pb.diag.status": said.first | said.second << 8 | said.third << 16,
        "pb.diag.words": ", ".join((*said.status_words, *said.block_words)),
        "pb.diag.master": said.master,
        "pb.diag.ident": said.ident,
    }
    octets = (said.first, said.second, said.third)
    found |= {f"pb.diag.{name}": int(bool(octets[at] & bit)) for name, (at, bit, _) in DIAGNOSIS_BITS.items()}
    if (blocks := said.block_words) != ():
        found["pb.diag.blocks"] = "; ".join(blocks)
    channel = next((one for one in parse_blocks(said.extended) if one.error is not None), None)
    if channel is not None and channel.module is not None and channel.channel is not None and channel.error:
        found |= {"pb.diag.module": channel.module, "pb.diag.channel": channel.channel, "pb.diag.error": channel.error}
    return {**found, "pb.diag.extended": said.extended.hex(" ")} if said.extended else found


def _parameters(data: bytes) -> Fields:
    said = parse_parameters(data)
    if said is None:
        return _short(Service.SET_PARAMETERS, data, LEAST)
    found: Fields = {"pb.prm.status": said.status, "pb.prm.words": ", ".join(said.words)}
    least, most = said.watchdogs_ms or (0, 0)
    if said.watchdogs_ms is not None and least == most:
        found["pb.prm.watchdog_ms"] = most
    found |= {"pb.prm.tsdr": said.tsdr, "pb.prm.ident": said.ident, "pb.prm.groups": said.groups}
    return {**found, "pb.prm.user": said.user.hex(" ")} if said.user else found
