"""The types of the fields of PROFIBUS: what `fields.py` may give."""

from __future__ import annotations

from dissectors.field_types import FieldType, FieldTypes, Kind, station, texts, whole
from dissectors.profibus.control import REQUESTS, StationType, Status
from dissectors.profibus.diagnosis import DIAGNOSIS_BITS
from dissectors.profibus.dpv1 import FUNCTIONS
from dissectors.profibus.services import Service
from dissectors.profibus.telegram import SC, SD1, SD2, SD3, SD4

_STARTS = {"SD1": SD1, "SD2": SD2, "SD3": SD3, "SD4": SD4, "SC": SC}


def types() -> FieldTypes:
    """By name."""
    text, number, octets = Kind.TEXT, Kind.NUMBER, Kind.OCTETS
    services = {name: one.value for one in Service for name in (one.title, one.value)}
    functions = texts(dict.fromkeys((*(one.name for one in REQUESTS.values()), *(one.words for one in Status))))
    return {
        "pb.sd": FieldType(number, "start delimiter", dict(_STARTS), octet=0),
        "pb.le": whole(8, "length, of SD2"),
        "pb.da": station(127, "station spoken to"),
        "pb.sa": station(127, "station that speaks"),
        "pb.fc": whole(8, "function code, the whole octet"),
        "pb.request": FieldType(Kind.TRUTH, "whether it is a request"),
        "pb.function": whole(4, "function, the low four bits"),
        "pb.function.name": FieldType(text, "the same in words", functions),
        "pb.fcb": FieldType(Kind.TRUTH, "frame count bit of a request"),
        "pb.fcv": FieldType(Kind.TRUTH, "whether that bit counts"),
        "pb.status": FieldType(text, "status of an answer", texts(one.short for one in Status)),
        "pb.station_type": FieldType(
            number, "who answers", {name: one.value for one in StationType for name in (one.words, one.name.lower())}
        ),
        "pb.dsap": whole(8, "access point spoken to"),
        "pb.ssap": whole(8, "access point that speaks"),
        "pb.service": FieldType(text, "what a telegram is for", services, closed=True),
        "pb.data": FieldType(octets, "data unit"),
        "pb.fcs": whole(8, "check as sent"),
        "pb.fcs.status": FieldType(number, "state of the check", {"Bad": 0, "Good": 1, "Not present": 3}),
        "pb.diag.status": whole(24, "the three status octets of a diagnosis, the first lowest"),
        "pb.diag.words": FieldType(text, "a diagnosis in words", several=False),
        "pb.diag.master": whole(8, "master that parameterised the slave, 255 for none"),
        "pb.diag.ident": whole(16, "ident number"),
        **{f"pb.diag.{name}": FieldType(Kind.TRUTH, words) for name, (_, _, words) in DIAGNOSIS_BITS.items()},
        "pb.diag.blocks": FieldType(text, "extended diagnosis in words", several=False),
        "pb.diag.module": whole(8, "module of the first channel diagnosis"),
        "pb.diag.channel": whole(8, "channel of the first channel diagnosis"),
        "pb.diag.error": FieldType(text, "what is wrong at that channel", several=False),
        "pb.v1.function": FieldType(number, "function of DP-V1", {words: code for code, words in FUNCTIONS.items()}),
        "pb.v1.function.name": FieldType(text, "the same in words", texts(FUNCTIONS.values())),
        "pb.v1.slot": whole(8, "slot read, written or told of"),
        "pb.v1.index": whole(8, "index read or written"),
        "pb.v1.length": whole(8, "octets asked for or told"),
        "pb.v1.data": FieldType(octets, "data of DP-V1"),
        "pb.v1.error": FieldType(text, "why it is refused", several=False),
        "pb.malformed": FieldType(text, "what is wrong with the content", several=False),
        "pb.diag.extended": FieldType(octets, "extended diagnosis"),
        "pb.prm.status": whole(8, "station status of Set_Prm"),
        "pb.prm.words": FieldType(text, "the same in words", several=False),
        "pb.prm.watchdog_ms": FieldType(Kind.DURATION, "watchdog", unit="ms"),
        "pb.prm.tsdr": whole(8, "min TSDR, bit times"),
        "pb.prm.ident": whole(16, "ident number"),
        "pb.prm.groups": whole(8, "groups, a bit each"),
        "pb.prm.user": FieldType(octets, "user parameters"),
        "pb.cfg": FieldType(octets, "configuration"),
        "pb.cfg.words": FieldType(text, "modules in words", several=False),
        "pb.cfg.inputs": FieldType(number, "octets of inputs"),
        "pb.cfg.outputs": FieldType(number, "octets of outputs"),
        "pb.cfg.modules": FieldType(number, "modules"),
        "pb.gc.command": whole(8, "Global_Control, the command octet"),
        "pb.gc.words": FieldType(text, "the same in words", several=False),
        "pb.gc.groups": whole(8, "groups that it is for, 0 all"),
        "pb.new_address": whole(8, "address given by Set_Slave_Add"),
        "pb.new_address.ident": whole(16, "ident number in it"),
        "func": whole(4, "function, the low four bits"),
        "addr": station(127),
        "register": whole(8, "access point of the slave"),
        "count": whole(8, "octets of data"),
        "kind": FieldType(text, "what a frame is", dict(services), closed=True),
    }
