"""Lines of known tools whose octets or meaning no general rule finds: one shape, one line of SHAPES. Pure.

Most tools need no line here: a time, a direction and octets are found wherever they stand (`log_clock.py`,
`log_spellings.py`), and what a label means is told by the whole log (`log_plan.py`).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from dissectors.checksums import crc16_modbus
from sniff.formats.log_memory import remembered

STAMP = "\0"
"""Stands in a line where a time was."""


class Role(Enum):
    """What a line of a log is."""

    DATA = "data"
    SAME = "same"  # repeats octets that another line of the log tells
    HEADING = "heading"  # says time or direction of the octets below
    NOTHING = "nothing"  # belongs to the log, and tells no octets
    PERHAPS = "perhaps"  # octets of which the whole log says whether another line tells them
    AGAIN = "again"  # what was told last comes again, with more behind


@dataclass(frozen=True, slots=True)
class Shape:
    """A shape of lines. `pattern`: found in the line, its time replaced by STAMP; groups that mean something:

    | group | what |
    |---|---|
    | `octets` | where the octets stand; without it they are looked for in the whole line |
    | `way` | the direction; without it it is looked for in the line |
    | `begin`, `end` | numbers of samples, of a logic analyser |
    | `cut` | there when the tool left octets out |
    | `count` | how many octets there were, where the tool may tell less |
    """

    tool: str
    pattern: re.Pattern[str]
    role: Role = Role.DATA
    whole: Callable[[bytes], bytes] | None = None
    """Octets that the tool tells without their check → as they were sent; none, where they never were."""
    base: int | None = None
    """Of the numbers in `octets`, where only the tool tells."""


PORTMON = "Portmon"
"""Whose times are how long each request took."""

_H = r"[0-9A-Fa-f]{1,2}"
_H2 = r"[0-9A-Fa-f]{2}"
_S = r"\0"


def _shape(
    tool: str,
    pattern: str,
    role: Role = Role.DATA,
    whole: Callable[[bytes], bytes] | None = None,
    base: int | None = None,
) -> Shape:
    return Shape(tool, re.compile(pattern), role, whole, base)


def _with_crc(octets: bytes) -> bytes:
    """A message with its CRC behind it, unless it has one; nothing in place of what is none: a number of the tool's."""
    if len(octets) < 2:
        return b""
    return octets if not crc16_modbus(octets) else octets + crc16_modbus(octets).to_bytes(2, "little")


_OWN_CODES = 0xE0
"""eModbus: from here on codes of exceptions are its own, of answers that did not come; no station can send them."""


def _of_emodbus(octets: bytes) -> bytes:
    """What eModbus hands on as an answer: nothing where it made it itself."""
    is_own = len(octets) == 1 or (len(octets) == 3 and octets[1] & 0x80 and octets[2] >= _OWN_CODES)
    return b"" if is_own else _with_crc(octets)


SHAPES: tuple[Shape, ...] = (
    _shape("esphome", rf"[Rr]eceived [Bb]yte\s+\d{{1,3}}\s+\(0[xX](?P<octets>{_H})\)"),
    _shape("esphome", rf"\b(?P<way>Read|Wrote|Write):?\s+(?:0b[01]{{8}}\s+)?\(?0x(?P<octets>{_H})\)?(?:\s|$)"),
    _shape("esphome", r"\[uart_debug:\d+\]"),
    _shape("candump", rf"^\s*\({_S}\)\s+\w+\s+(?:[0-9A-Fa-f]+(?:#|\s+\[\d+\]\s+))?(?P<octets>.+)"),
    _shape("strace", r"<\.\.\. (?P<way>p?read(?:64|v)?|recv\w*) resumed>\s*,? ?"
                     r"(?P<octets>\"(?:[^\"\\]|\\.)*\")(?P<cut>\.\.\.)?.*\)\s*=\s*\d+"),
    _shape("strace", r"\b(?P<way>p?write(?:64|v)?|send\w*)\((?:[3-9]|\d{2,})(?:<[^>]*>)?, "
                     r"(?P<octets>\"(?:[^\"\\]|\\.)*\")(?P<cut>\.\.\.)?.*<unfinished \.\.\.>"),
    _shape("strace", r"\b(?P<way>p?(?:read|write)(?:64|v)?|recv\w*|send\w*)\((?:[3-9]|\d{2,})(?:<[^>]*>)?, "
                     r"(?!\"\\(?:177ELF|x7f\\x45\\x4c\\x46))"  # a program, and what it prints
                     r"(?P<octets>\"(?:[^\"\\]|\\.)*\")(?P<cut>\.\.\.)?.*\)\s*=\s*\d+"),
    _shape("usbmon", r"^[0-9a-f]{8,16} (?:\d+|\0) [SC] (?P<way>B[io]):\d+:\d+:\d+ -?\d+ (?P<count>\d+) = "
                     r"(?P<octets>[0-9a-f]{2,8}(?: [0-9a-f]{2,8})*)$"),
    _shape("usbmon", r"^[0-9a-f]{8,16} (?:\d+|\0) [SCE] [BCIZ][io]:\d+:\d+", Role.NOTHING),
    _shape("strace", r"\b(?:read|write)\([0-2], ", Role.NOTHING),
    _shape("strace", r"^(?:[\d\s\0]*\s)?(?:[a-z]\w{0,30}\(.*\)?\s*=\s*-?\d|<\.\.\. |--- SIG|\+\+\+ )", Role.NOTHING),
    _shape("interceptty", rf"^(?P<way>[<>])\s+0x(?P<octets>{_H})\s+\(.{{1,6}}\)"),
    _shape("socat", rf"^(?P<way>[<>]) {_S} +length=\d+ from=\d+ to=\d+", Role.HEADING),
    _shape("socat", r"^--$", Role.NOTHING),
    _shape("sigrok", r"\"ph\": \"B\", .*\"pid\": \"uart-\d+\", \"tid\": \"(?P<way>[RT]X)\", "
                     r"\"name\": \"(?P<octets>[0-9A-F]{2})\""),
    _shape("sigrok", r"\"ph\": \"[BE]\", .*\"pid\": ", Role.NOTHING),
    _shape("sigrok", r"^(?:(?P<begin>\d+)-(?P<end>\d+)\s+[\w /.-]+?|\w+-\d+): ?"
                     r"(?:.*?\b(?P<way>[RrTt][Xx])(?:[ -]data)?: ?)?"
                     r"\"?(?P<octets>[0-9A-Fa-f]{2})\"?$"),
    _shape("sigrok", r"^(?:\d+-\d+\s+[\w /.-]+?|\w+-\d+): ?(?:.*: ?)?"
                     r"(?:[Ss]tart bit|[Ss]top bit|[Pp]arity|[01]$|Frame error|Break)",
           Role.NOTHING),
    _shape("minimalmodbus", rf"^(?!.*MinimalModbus debug mode).*?\b(?P<way>The response) is: "
                            rf"(?P<octets>b?'(?:[^'\\]|\\.)*'|b?\"(?:[^\"\\]|\\.)*\"|{_H2}(?: {_H2})*)", Role.PERHAPS),
    _shape("minimalmodbus", rf"MinimalModbus debug mode\. (?:(?P<way>Writing)|Response).*"
                            rf"['\"] \((?P<octets>{_H2}(?: {_H2})*)\)"),
    _shape("minimalmodbus", r"MinimalModbus debug mode\. (?:Will write|Writing|Response)"),
    _shape("minimalmodbus", r"MinimalModbus debug mode\. "
                            r"(?:Clearing|No sleep|Sleeping|Create|Closing|Opening|Will sleep)",
           Role.NOTHING),
    _shape("node-modbus-serial", r"\bdata: <Buffer (?P<octets>[0-9a-f ]+?)(?P<cut> \.\.\.[^>]*)?>"),
    _shape("node-modbus-serial", r"\bbuffer: <Buffer", Role.SAME),
    _shape("jsmodbus", r"\brtu-response address \d+ buffer <Buffer", Role.SAME),
    _shape("node-modbus-serial", r"<Buffer (?P<octets>[0-9a-f ]+?)(?P<cut> \.\.\.[^>]*)?(?:>|\s*$)", Role.PERHAPS),
    _shape("node-modbus-serial", r"\"type\":\s*\"Buffer\",\s*\"data\":\s*(?P<octets>\[[\d,\s]+\])", Role.PERHAPS,
           base=10),
    _shape("QModMaster", rf"\[(?:RTU|ASCII|TCP)\]>\s*(?P<way>[TR]x)\s*>\s*{_S}\s*-"),
    _shape("QModMaster", r"^Sys\s*>", Role.NOTHING),
    _shape("Modbus Poll", r"(?P<way>[TR]x):\s?\d{4,9}-"),
    _shape("mbpoll", r"^\[\d+\]:\s+-?[\d.]+(?:\s\(.*\))?$", Role.NOTHING),
    _shape("libmodbus", r"^(?:Waiting for|ERROR |Request for slave|Opening |Bytes flushed|Connecting|The responding)",
           Role.NOTHING),
    _shape("libmodbus", r"^\s*(?:[\[<][0-9A-F]{2}[\]>]){3,}"),
    _shape("pymodbus", r"\bFrame - (?:\[.*\] )?not ready\b", Role.AGAIN),
    _shape("pymodbus", r"\b(?P<way>send|recv|SEND|RECV):\s+0x"),
    _shape("modbus_tk", r"(?P<way>->|<-)\s*\d{1,3}-\d{1,3}-\d{1,3}"),
    _shape("mbusd", rf"\bconn\[[^\]]*\]: (?P<way>request): (?P<octets>(?:\[{_H2}\])+)", whole=_with_crc),
    _shape("mbusd", rf"\bconn\[[^\]]*\]: (?P<way>response): (?P<octets>(?:\[{_H2}\])+)", Role.PERHAPS, _with_crc),
    _shape("jpnevulator", rf"^\s*{_S}: \S+$", Role.HEADING),
    _shape("Docklight", r"\[(?P<way>TX|RX|C1|C2)\]"),
    _shape("Docklight", r"^\s*Docklight", Role.NOTHING),
    _shape("eModbus", r"\b(?P<way>Sent|Received|Request) packet: @[0-9A-Fa-f]{6,16}/\d", Role.HEADING, _with_crc),
    _shape("eModbus", r"\b(?P<way>Response) packet: @[0-9A-Fa-f]{6,16}/\d", Role.HEADING, _of_emodbus),
    _shape("eModbus", r"\bData: @[0-9A-Fa-f]{6,16}/\d", Role.HEADING, _of_emodbus),
    _shape("eModbus", r"\bRaw buffer (?P<way>received): @[0-9A-Fa-f]{6,16}/\d", Role.HEADING),
    _shape("eModbus", r"\|\s*\w+\.(?:cpp|h)\s*\[.*\]"),
    _shape(PORTMON, r"\bIRP_MJ_(?P<way>READ|WRITE)\s+\S+\s+[A-Z_]+\s+"
                    rf"Length:? (?P<count>\d+):?\s+(?P<octets>{_H2}(?: {_H2})*)"),
    _shape(PORTMON, r"\b(?:IRP_MJ|IOCTL)_\w+\s+\S+\s+(?:SUCCESS|TIMEOUT|CANCELLED|PENDING)\b", Role.NOTHING),
    _shape("Serial Port Monitor", r"(?P<way>Read|Written|Write) data \(COM\d+\)", Role.HEADING),
    _shape("Serial Port Monitor", r"(?:Open|Close|Opened|Closed)\b.*port|IOCTL_|IRP_MJ_(?:CREATE|CLOSE|DEVICE)",
           Role.NOTHING),
    _shape("Device Monitoring Studio", r"IRP_MJ_(?P<way>READ|WRITE)", Role.HEADING),
    _shape("PuTTY", r"^=~=~=~.*PuTTY log", Role.NOTHING),
    _shape("PuTTY", rf"^(?P<way>Incoming|Outgoing) (?:raw data|packet) (?:.*{_S})?", Role.HEADING),
)  # fmt: skip
"""The first that is found in a line counts."""

_OF_TSHARK = "the capture itself, or `tshark -x` of it"

BUFFER = re.compile(r"\bProcessing:$|~-handler buffer(?: ~Buffer)?$")
"""Labels of known tools (pymodbus, jsmodbus) that tell a buffer: what waits in it, and what came to that."""

DECODED = (
    (re.compile(r"<pdml[ >]"), "PDML, which has decoded fields and no octets as they were sent", _OF_TSHARK),
    (re.compile(r"<psml[ >]"), "PSML, which has summaries of packets and no octets", _OF_TSHARK),
    (
        re.compile(r'"_index": "packets-'),
        "JSON of tshark, which has decoded fields and no octets as they were sent",
        _OF_TSHARK,
    ),
    (
        re.compile(r"\A(?![\s\S]*\buart-\d+: )[\s\S]*\bmodbus-\d+: (?:[a-z-]+: )?\"?Slave ID: \d+"),
        "annotations of sigrok that have decoded fields and no octets",
        "the capture itself, or `-A uart` of it",
    ),
    (
        re.compile(r"\A(?![\s\S]*(?:Read|Written|Write) data \(COM\d)[\s\S]*Modbus (?:Request|Response) \(COM\d+\)"),
        "the Modbus view of a serial port monitor, which has decoded fields and no octets as they were sent",
        "its dump view",
    ),
)
"""Texts that tell what octets mean, and not which they were."""

WAYS = re.compile(
    r"(?<![A-Za-z0-9_<>=-])(?:>>>|<<<|>>|<<|-->|<--|==>|<==|->|<-|=>|<=|>|<(?![A-Za-z_/]\w*>)|→|←)(?![<>=-])"
    r"|(?<![A-Za-z])(?:tx[d]?|rx[d]?|sen(?:d|ds|t|ding)|transmit(?:s|ted|ting)?|recv|rcv[d]?|receiv(?:e[d]?|ing)|writ(?:e|ing|ten)|wrote|read|"
    r"in|out|input|output|incoming|outgoing|request|response|req|re?sp|query|answer|reply|to|from|"
    r"master|slave|host|device|dte|dce|(?<!\d)c[12](?!\d)|poll)(?![A-Za-z])",
    re.IGNORECASE,
)
"""How tools say which way octets went."""

COLOURS = re.compile(r"\x1b(?:\[[0-9;?]*[A-Za-z]|\][^\x07\x1b]{0,400}(?:\x07|\x1b\\)|[()][0-9A-Z])")
"""What tools for terminals put around a line."""

REMARK = ("#", ";", "//")


@remembered
def shape_of(line: str) -> tuple[Shape, re.Match[str]] | None:
    """The known shape of a line and where it was found."""
    for shape in SHAPES:
        match = shape.pattern.search(line)
        if match is not None:
            return shape, match
    return None
