"""Shapes that programs give one conversation: arrays over lines, other escapes, dumps of any base, rulers, wrappers."""
# ruff: noqa: E501

from __future__ import annotations

import json
from base64 import b64encode

from tests.sniff.formats.shapes_made import ALL, FR, N, add, hx, lines, way

QUOTED = {7: "\\a", 8: "\\b", 9: "\\t", 10: "\\n", 11: "\\v", 12: "\\f", 13: "\\r", 34: '\\"', 92: "\\\\"}


def shown(octets: bytes, escape: str, quoted: dict[int, str] | None = None) -> str:
    """Characters that can be shown as they are, the others as `escape` says."""
    held = quoted or {}
    return "".join(
        held.get(octet, chr(octet) if 0x20 < octet < 0x7F else escape.format(octet, octet)) for octet in octets
    )


def characters(octets: bytes) -> str:
    return "".join(chr(octet) if 0x20 <= octet < 0x7F else "." for octet in octets)


def clock(number: int) -> str:
    return f"10:00:{number:02d}.100"


def rows(octets: bytes, form: str, cell: str, width: int = 16) -> str:
    held = (octets[at : at + width] for at in range(0, len(octets), width))
    return "".join(
        form.format(number * width) + "".join(cell.format(octet) for octet in row) + "\n"
        for number, row in enumerate(held)
    )


S = 10**9

# -- lists over several lines
add(
    "json-indented",
    "".join(
        json.dumps({"time": f"2024-11-28T{clock(i)}Z", "dir": way(i), "data": list(f)}, indent=2) + "\n"
        for i, f in enumerate(FR)
    ),
    delta=S,
)
add("rust-pretty", "".join(f"{way(i)} = [\n" + "".join(f"    0x{b:x},\n" for b in f) + "]\n" for i, f in enumerate(FR)))
add(
    "php-print_r",
    "".join(
        f"{way(i)}\nArray\n(\n" + "".join(f"    [{k + 1}] => {b}\n" for k, b in enumerate(f)) + ")\n\n"
        for i, f in enumerate(FR)
    ),
)
add(
    "php-var_dump",
    "".join(f"array({len(f)}) {{\n" + "".join(f"  [{k}]=>\n  int({b})\n" for k, b in enumerate(f)) + "}\n" for f in FR),
)
add(
    "node-array",
    "".join(
        f"{way(i)} [\n"
        + ",\n".join("  " + ", ".join(f"{b:3d}" for b in f[k : k + 12]) for k in range(0, len(f), 12))
        + "\n]\n"
        for i, f in enumerate(FR)
    ),
)

# -- numbers with something beside them
add(
    "gdb-repeats",
    f"$1 = {{{', '.join(f'0x{b:x}' for b in FR[0])}}}\n$2 = {{0x11, 0x10, 0x0 <repeats 5 times>, 0x7}}\n" * 3,
    exp=(FR[0] + b"\x11\x10" + bytes(5) + b"\7") * 3,
)
add("numbers-in-columns", lines(lambda i, f: f"{way(i)} [" + " ".join(f"{b:3d}" for b in f) + "]"))
add("matlab", lines(lambda i, f: f"{way(i)} =\n\n" + "".join(f"{b:6d}" for b in f) + "\n"))
add("0x-joined", lines(lambda i, f: f"{way(i)}: " + hx(f, "", "0x{:02X}")))
add("visual-basic", lines(lambda i, f: f"{clock(i)} {way(i)} {hx(f, ' ', '&H{:02X}')}"), delta=S)
add("melsec", lines(lambda i, f: f"{clock(i)} {way(i)} {hx(f, ' ', 'H{:02X}')}"), delta=S)
add("step-7", lines(lambda i, f: f"{way(i)};{hx(f, ';', 'B#16#{:02X}')}"))
add("octets-explained", "".join("".join(f"[{k:02d}] 0x{b:02X}  (part of it)\n" for k, b in enumerate(f)) for f in FR))

# -- strings
add("go-quoted", lines(lambda i, f: f'{clock(i)} {way(i)} "{shown(f, chr(92) + "x{:02x}", QUOTED)}"'), delta=S)
add("lua", lines(lambda i, f: f'{way(i)} "{shown(f, chr(92) + "{:03d}", {34: chr(92) + chr(34)})}"'))
add(
    "labview",
    lines(
        lambda i, f: (
            f"{clock(i)}\t{way(i)}\t"
            + shown(f, "\\{:02X}", {9: "\\t", 10: "\\n", 13: "\\r", 8: "\\b", 12: "\\f", 32: "\\s", 92: "\\\\"})
        )
    ),
    delta=S,
)
add("escapes-unquoted", lines(lambda i, f: f"{clock(i)} {way(i)} {shown(f, chr(92) + 'x{:02x}')}"), delta=S)
add("characters-among-brackets", lines(lambda i, f: shown(f, "[{:02x}]")))
add("characters-among-braces", lines(lambda i, f: shown(f, "{{{:02X}}}")))
add("strings-of-a-character", lines(lambda i, f: "".join(f" [{way(i)}:{chr(b)!r}] " for b in f)))
add(
    "base64",
    lines(lambda i, f: json.dumps({"time": f"2024-11-28T{clock(i)}Z", "data": b64encode(f).decode()})),
    delta=S,
)
add(
    "docker-json",
    lines(lambda i, f: json.dumps({"log": f"{way(i)} {hx(f)}\n", "time": f"2024-11-28T10:00:{i:02d}.123456789Z"})),
    delta=S,
)
add(
    "json-all-on-one-line",
    json.dumps([{"t": 1000 + 137 * i, "data": f.hex()} for i, f in enumerate(FR)]),
    delta=137_000_000,
)

# -- dumps
add("od-octal", rows(ALL, "{:07o}", " {:03o}") + f"{len(ALL):07o}\n")
add("od-decimal", rows(ALL, "{:07o}", " {:3d}") + f"{len(ALL):07o}\n")
OF_C = {0: "  \\0", **{octet: f"  {text}" for octet, text in QUOTED.items() if octet < 0x20}}
add(
    "od-characters",
    "".join(
        f"{at:07o}"
        + "".join(OF_C.get(b, f"   {chr(b)}" if 0x20 <= b < 0x7F else f" {b:03o}") for b in ALL[at : at + 16])
        + "\n"
        for at in range(0, len(ALL), 16)
    )
    + f"{len(ALL):07o}\n",
)
PADDED = ALL + bytes(-len(ALL) % 4)
add(
    "od-long-words",
    "".join(
        f"{at:07o}"
        + "".join(f" {PADDED[k : k + 4][::-1].hex()}" for k in range(at, min(at + 16, len(PADDED)), 4))
        + "\n"
        for at in range(0, len(PADDED), 16)
    )
    + f"{len(ALL):07o}\n",
)
add(
    "groups-of-four",
    "".join(
        f"{way(i)}: {len(f)} bytes\n"
        + "".join(
            f"{at:04x}:   {'  '.join(hx(f[k : k + 4]) for k in range(at, min(at + 16, len(f)), 4))}   {characters(f[at : at + 16])}\n"
            for at in range(0, len(f), 16)
        )
        for i, f in enumerate(FR)
    ),
)
RULER = "00 01 02 03 04 05 06 07 - 08 09 0A 0B 0C 0D 0E 0F"
add(
    "ruler",
    "".join(
        f"{way(i)}:\n          {RULER}  0123456789ABCDEF\n\n"
        + "".join(
            f"{at:08X}  {hx(f[at : at + 8]):23} - {hx(f[at + 8 : at + 16]):23}  {characters(f[at : at + 16])}\n"
            for at in range(0, len(f), 16)
        )
        for i, f in enumerate(FR)
    ),
)
add(
    "netty",
    "".join(
        f"{clock(i)} DEBUG LoggingHandler - [id: 0x9c2b7f1a] {'WRITE' if i % 2 == 0 else 'READ'}: {len(f)}B\n"
        "         |  0  1  2  3  4  5  6  7  8  9  a  b  c  d  e  f |\n"
        + "".join(
            f"|{at:08x}| {hx(f[at : at + 16]).lower():48}|{characters(f[at : at + 16]):16}|\n"
            for at in range(0, len(f), 16)
        )
        for i, f in enumerate(FR)
    ),
    delta=S,
)
add(
    "ngrep",
    "".join(
        f"T 10.0.0.5:40122 -> 10.0.0.9:4001 [AP] #{i}\n"
        + "".join(
            f"  {hx(f[at : at + 8]):23}    {hx(f[at + 8 : at + 16]):23}    {characters(f[at : at + 16])}\n"
            for at in range(0, len(f), 16)
        )
        for i, f in enumerate(FR)
    ),
)

# -- what programs say of a line
add(
    "strace-resumed",
    "".join(
        f'812 {clock(i)} write(5</dev/ttyUSB0>, "{hx(f, "", chr(92) + "x{:02x}")}", {len(f)}) = {len(f)}\n'
        if i % 2 == 0
        else f"812 {clock(i)} read(5</dev/ttyUSB0>,  <unfinished ...>\n"
        f'812 {clock(i)} <... read resumed>"{hx(f, "", chr(92) + "x{:02x}")}", 256) = {len(f)}\n'
        for i, f in enumerate(FR)
    ),
    delta=S,
)
add(
    "usbmon",
    lines(
        lambda i, f: (
            f"ffff9c8d4f1a2b00 {123456789 + i * 137000} {'S Bo' if i % 2 == 0 else 'C Bi'}:1:005:2 0 {len(f)} = "
            + " ".join(f.hex()[k : k + 8] for k in range(0, 2 * len(f), 8))
        )
    ),
    delta=137_000_000,
)
add(
    "sent-and-written",
    lines(lambda i, f: f"2024-11-28 {clock(i)} MB: sends {f.hex()}\n2024-11-28 {clock(i)} SW: {f.hex()}"),
    delta=S,
)
add(
    "erlang",
    lines(lambda i, f: f"=DEBUG==== 28-Nov-2024::{clock(i)} ===\n{way(i)} <<{','.join(f'16#{b:02X}' for b in f)}>>"),
    delta=S,
)
add("dots-in-the-clock", lines(lambda i, f: f"10.00.{i:02d}.250  {way(i)}  {hx(f)}"), delta=S)
add(
    "ns-at-the-end",
    lines(lambda i, f: f'rs485,dir={way(i)} data="{f.hex()}" {1732788000 + i}000000000'),
    delta=S,
    first=1732788000 * S,
)
add(
    "request-beside-answer",
    "REQUEST | RESPONSE\n" + "".join(f"{hx(FR[i]):40}| {hx(FR[i + 1])}\n" for i in range(0, N, 2)),
)
SHORT = [*FR, b"\x11\x83\x02\xc1\x34"]
add(
    "short-without-space",
    "".join(f"{clock(i)} {way(i)} len {len(f):>3} | {f.hex()} | ok\n" for i, f in enumerate(SHORT)),
    exp=b"".join(SHORT),
    delta=S,
)
add("dotted-hosts-are-none", "host: 10.0.0.5\n" * 3 + lines(lambda i, f: f"{way(i)}: {', '.join(map(str, f))}"))

# -- annotations of a logic analyser in other bases, and of one line decoded as two
for name, form in (("decimal", "{}"), ("octal", "{:03o}"), ("bits", "{:08b}")):
    add(
        f"annotations-{name}",
        "".join(f"{1000 * k}-{1000 * k + 833} uart-1: {form.format(b)}\n" for k, b in enumerate(ALL)),
    )
add("annotations-characters", "".join(f"uart-1: {chr(b) if 0x20 <= b < 0x7F else f'[{b:02X}]'}\n" for b in ALL))
add("annotations-twice", "".join(f"{1000 * k}-{1000 * k + 833} uart-1: {b:02X}\n" * 2 for k, b in enumerate(ALL)))
add(
    "annotations-as-events",
    '{"traceEvents": [\n'
    + "".join(
        f'{{"ph": "{ph}", "ts": {1000.0 * k}, "pid": "uart-1", "tid": "RX", "name": "{b:02X}"}},\n'
        for k, b in enumerate(ALL)
        for ph in "BE"
    ),
    delta=1_000_000,
)

# -- tables
add(
    "csv-day-beside-time",
    "Date\tTime\tDir\tData\n" + lines(lambda i, f: f"11/28/2024\t{clock(i)}\t{way(i)}\t{hx(f)}"),
    delta=S,
    first=1732788000 * S + S // 10,
)
add(
    "csv-message",
    '"timestamp","source","message"\n' + lines(lambda i, f: f'"2024-11-28T{clock(i)}Z","gw","{way(i)} {hx(f)}"'),
    delta=S,
)
add(
    "csv-rx-and-tx",
    "NO.,TIME,RX,RX Err,TX,TX Err\n"
    + "".join(
        f"{k},{k * 1.15:.4f}ms,{'' if k % 2 else f'0x{b:02X}'},,{f'0x{b:02X}' if k % 2 else ''},\n"
        for k, b in enumerate(ALL)
    ),
    delta=1_150_000,
)
add(
    "csv-request-and-response",
    "No;Time;Request;Response\n" + "".join(f"{i};{clock(i)};{hx(FR[i])};{hx(FR[i + 1])}\n" for i in range(0, N, 2)),
)

# -- what is decoded already
add(
    "pdml",
    '<?xml version="1.0"?>\n<pdml version="0">\n<packet>\n<field name="x" show="01 03 00 00 00 02 C4 0B"/>\n',
    exp=None,
)
add("tshark-json", '[\n  {\n    "_index": "packets-2024-11-28",\n    "x": "01:03:00:00:00:02:c4:0b"\n', exp=None)
add("annotations-decoded", "100-200 modbus-1: Slave ID: 17\n" * 9, exp=None)
add(
    "fields-with-names",
    lines(lambda i, f: f"{way(i)} addr={f[0]:02X} fc={f[1]:02X} data={f[2:-2].hex()} crc={f[-2:].hex()}"),
)
add(
    "left-out-in-brackets",
    lines(lambda i, f: f"{way(i)}: {hx(f[:16])}{' [...]' if len(f) > 16 else ''}"),
    exp=b"".join(f[:16] for f in FR),
    whole=False,
)
add(
    "octal-before-an-8",
    lines(lambda i, f: f'{clock(i)} {way(i)} "\\0' + "8" + shown(f, "\\{0:03o}", QUOTED) + '\\377"'),
    exp=b"".join(b"\0" + b"8" + f + b"\xff" for f in FR),
)
