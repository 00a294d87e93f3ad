"""A telegram as a tree: its envelope, and what the DP service in it says, octet by octet with names."""

from __future__ import annotations

from collections.abc import Callable

from dissectors.checksums import sum8
from dissectors.findings import counted
from dissectors.meaning import Node
from dissectors.profibus import diagnosis as diag
from dissectors.profibus import parameters as prm
from dissectors.profibus.configuration import parse_configuration
from dissectors.profibus.control import Control
from dissectors.profibus.dpv1 import parse_acyclic
from dissectors.profibus.services import ACYCLIC, Service, sap_name, service_of
from dissectors.profibus.telegram import BROADCAST, ED, SD2, SD3, Telegram, body_of, parse

Nodes = tuple[Node, ...]
_STARTS = {0x10: "SD1: no data", SD2: "SD2: variable length", SD3: "SD3: eight octets of data"}


def outline(octets: bytes) -> Nodes | None:
    """The tree of a telegram, `begin` and `end` in its octets; None of anything else."""
    telegram = parse(octets)
    if telegram.is_short:
        return (Node("start", "SC: short acknowledgement, by who was asked", 0, 1),)
    if telegram.is_token and telegram.source is not None:
        return (
            Node("start", "SD4: token", 0, 1),
            Node("destination", f"{telegram.destination}, which may send now", 1, 2),
            Node("source", f"{telegram.source}", 2, 3),
        )
    if telegram.control is None:
        return None
    body = body_of(octets)
    at = 4 if octets[0] == SD2 else 1
    behind = at + len(body)
    nodes = [Node("start", _STARTS.get(octets[0], f"{octets[0]:02X}h"), 0, 1)]
    if octets[0] == SD2:
        nodes.append(Node("length", _length(octets), 1, 4))
    nodes += [
        Node("destination", _station(telegram.destination, octets[at]), at, at + 1),
        Node("source", _station(telegram.source, octets[at + 1]), at + 1, at + 2),
        Node("frame control", f"{octets[at + 2]:02X}h", at + 2, at + 3, _control(telegram.control, at + 2)),
        *_extensions(telegram, at + 3),
    ]
    content = at + 3 + telegram.extended
    nodes.append(_content(telegram, content, behind))
    if len(octets) > behind:
        nodes.append(Node("check", _check(octets[behind], body), behind, behind + 1))
    if len(octets) > behind + 1:
        end = octets[behind + 1]
        nodes.append(Node("end", f"{end:02X}h" + ("" if end == ED else ", 16h expected"), behind + 1, behind + 2))
    return tuple(nodes)


def _length(octets: bytes) -> str:
    told = f"{octets[1]}"
    return told if octets[1] == octets[2] else f"{told}, repeated as {octets[2]}"


def _station(address: int | None, octet: int) -> str:
    name = "all" if address == BROADCAST else f"{address}"
    return name + (", an access point follows" if octet & 0x80 else "")


def _check(octet: int, body: bytes) -> str:
    right = sum8(body)
    return f"{octet:02X}h" + ("" if octet == right else f", {right:02X}h expected")


def _control(control: Control, at: int) -> Nodes:
    def line(name: str, text: str) -> Node:
        return Node(name, text, at, at + 1)

    if control.is_request:
        nodes = [line("function", control.words)]
        if control.fcv:
            nodes.append(line("frame count bit", str(int(control.fcb))))
        elif not control.is_sdn:
            nodes.append(line("frame count bit", "begins anew" if control.fcb else "not in use"))
        return tuple(nodes)
    status, station = control.status, control.station_type
    said = control.words if status is None else f"{status.words} ({status.short})"
    return line("status", said), *((line("station", station.words),) if station is not None else ())


def _extensions(telegram: Telegram, at: int) -> list[Node]:
    if not telegram.extended:
        return []
    end, nodes = at + telegram.extended, []
    points = [("destination access point", telegram.dsap), ("source access point", telegram.ssap)]
    told = [(name, point) for name, point in points if point is not None]
    for place, (name, point) in enumerate(told):
        whole = telegram.extended == len(told)  # else segment addresses stand among them
        begin, behind = (at + place, at + place + 1) if whole else (at, end)
        nodes.append(Node(name, sap_name(point, place == 0, telegram.is_request), begin, behind))
    return nodes


def _content(telegram: Telegram, begin: int, end: int) -> Node:
    service = service_of(telegram)
    told = _TOLD.get((service, telegram.is_request))
    if service in ACYCLIC:
        nodes = _acyclic(telegram.data, begin, telegram.is_request)
    else:
        nodes = told(telegram.data, begin) if told is not None and telegram.data else ()
    if not nodes and telegram.data:
        nodes = (_octets("data", telegram.data, begin),)
    return Node(service.title, "" if nodes else "no data", begin, end, nodes)


def _octets(name: str, data: bytes, begin: int) -> Node:
    return Node(name, data.hex(" "), begin, begin + len(data))


def _short(data: bytes, begin: int, least: int) -> Nodes:
    return (
        Node(
            "too short", f"{counted(len(data), 'octet')}, {least} expected: {data.hex(' ')}", begin, begin + len(data)
        ),
    )


def _bits(name: str, octet: int, at: int, words: tuple[tuple[int, str], ...]) -> Node:
    set_ones = tuple(Node(word, "yes", at, at + 1) for bit, word in words if octet & bit)
    unknown = octet & ~sum(bit for bit, _ in words)
    more = (Node("reserved", f"{unknown:02X}h", at, at + 1),) if unknown else ()
    return Node(name, f"{octet:02X}h", at, at + 1, set_ones + more)


def _diagnosis(data: bytes, begin: int) -> Nodes:
    said = diag.parse_diagnosis(data)
    if said is None:
        return _short(data, begin, diag.STANDARD)
    master = "none" if said.master == diag.NO_MASTER else f"{said.master}"
    nodes = [
        _bits("station status 1", said.first, begin, diag.FIRST),
        _bits("station status 2", said.second, begin + 1, (*diag.SECOND, (0x04, "always 1"))),
        _bits("station status 3", said.third, begin + 2, ((diag.OVERFLOW, "diagnosis overflow"),)),
        Node("master", master, begin + 3, begin + 4),
        Node("ident number", f"{said.ident:04X}h", begin + 4, begin + 6),
    ]
    at = begin + diag.STANDARD
    nodes += [Node(one.title, one.words, at + one.begin, at + one.end) for one in diag.parse_blocks(said.extended)]
    return tuple(nodes)


def _parameters(data: bytes, begin: int) -> Nodes:
    said = prm.parse_parameters(data)
    if said is None:
        return _short(data, begin, prm.LEAST)
    factors = f"{said.factors[0]} × {said.factors[1]}"
    nodes = [
        _bits("station status", said.status, begin, prm.STATUS),
        Node("watchdog", f"{said.watchdog_words} ({factors})" if said.watchdog_words else "off", begin + 1, begin + 3),
        Node("min TSDR", f"{said.tsdr} bit times" if said.tsdr else "as it is", begin + 3, begin + 4),
        Node("ident number", f"{said.ident:04X}h", begin + 4, begin + 6),
        Node("groups", f"{said.groups:02X}h" if said.groups else "none", begin + 6, begin + 7),
    ]
    if said.user:
        nodes.append(_octets("user parameters", said.user, begin + prm.LEAST))
    return tuple(nodes)


def _configuration(data: bytes, begin: int) -> Nodes:
    modules = parse_configuration(data)
    nodes = []
    for place, module in enumerate(modules):
        raw = data[module.begin : module.end].hex(" ")
        told = [module.words, *(["consistent " + module.consistency] if module.consistency else [])]
        if module.makers:
            told.append(f"maker's {module.makers.hex(' ')}")
        nodes.append(Node(f"module {place}", f"{raw}: {', '.join(told)}", begin + module.begin, begin + module.end))
    rest = data[modules[-1].end if modules else 0 :]
    if rest:
        nodes.append(Node("cut off", rest.hex(" "), begin + len(data) - len(rest), begin + len(data)))
    return tuple(nodes)


def _global_control(data: bytes, begin: int) -> Nodes:
    said = prm.parse_global_control(data)
    if said is None:
        return _short(data, begin, 2)
    groups = "all" if not said.groups else ", ".join(str(bit + 1) for bit in range(8) if said.groups >> bit & 1)
    return (
        Node("command", f"{said.command:02X}h: {said.words}", begin, begin + 1),
        Node("groups", groups, begin + 1, begin + 2),
    )


def _new_address(data: bytes, begin: int) -> Nodes:
    said = prm.parse_new_address(data)
    if said is None:
        return _short(data, begin, 4)
    nodes = [
        Node("new address", f"{said.address}", begin, begin + 1),
        Node("ident number", f"{said.ident:04X}h", begin + 1, begin + 3),
        Node("may be changed again", "no" if said.is_final else "yes", begin + 3, begin + 4),
    ]
    return tuple([*nodes, _octets("remanent data", said.user, begin + 4)] if said.user else nodes)


def _process(name: str) -> Callable[[bytes, int], Nodes]:
    def told(data: bytes, begin: int) -> Nodes:
        return (_octets(name, data, begin),)

    return told


def _acyclic(data: bytes, begin: int, is_request: bool) -> Nodes:
    said = parse_acyclic(data, is_request)
    if said is None:
        return ()
    nodes = [Node("function", f"{data[0]:02X}h: {said.name}" + (" refused" if said.error else ""), begin, begin + 1)]
    if said.error is not None:
        nodes.append(Node("reason", said.error, begin + 1, min(begin + 4, begin + len(data))))
    parts = (("slot", said.slot), ("index", said.index), ("length", said.length))
    nodes += [
        Node(name, f"{value}", begin + at, begin + at + 1)
        for at, (name, value) in enumerate(parts, 1)
        if value is not None
    ]
    if said.data:
        nodes.append(_octets("data", said.data, begin + len(data) - len(said.data)))
    if said.is_cut:
        nodes.append(Node("cut off", counted(len(data), "octet"), begin, begin + len(data)))
    return tuple(nodes)


_TOLD: dict[tuple[Service, bool], Callable[[bytes, int], Nodes]] = {
    (Service.DIAGNOSIS, False): _diagnosis,
    (Service.SET_PARAMETERS, True): _parameters,
    (Service.CHECK_CONFIGURATION, True): _configuration,
    (Service.GET_CONFIGURATION, False): _configuration,
    (Service.GLOBAL_CONTROL, True): _global_control,
    (Service.SET_ADDRESS, True): _new_address,
    (Service.DATA_EXCHANGE, True): _process("outputs"),
    (Service.DATA_EXCHANGE, False): _process("inputs"),
    (Service.READ_INPUTS, False): _process("inputs"),
    (Service.READ_OUTPUTS, False): _process("outputs"),
}
