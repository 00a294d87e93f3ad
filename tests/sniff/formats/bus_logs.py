"""One conversation of a bus with several stations, as more tools write it: what went over the line, and the log of it."""
# ruff: noqa: E501

from __future__ import annotations

import datetime
from collections.abc import Callable
from dataclasses import dataclass

from dissectors.checksums import crc16_modbus

NS = 1_000_000_000
STARTED = datetime.datetime(2026, 3, 1, 10, 0, 0, tzinfo=datetime.UTC)


@dataclass(frozen=True, slots=True)
class Said:
    """A frame: s since the begin, whether it is the master's, its octets."""

    at: float
    asks: bool
    octets: bytes

    @property
    def time(self) -> datetime.datetime:
        """When its last octet came."""
        return STARTED + datetime.timedelta(seconds=self.at)

    @property
    def epoch(self) -> int:
        """The same in ns since 1970, a whole number of µs."""
        return round(self.time.timestamp() * 1e6) * 1000


def _crc(*octets: int) -> bytes:
    message = bytes(octets)
    return message + crc16_modbus(message).to_bytes(2, "little")


def _conversation() -> list[Said]:
    """Reads and writes of four stations, refusals, one without an answer, an answer of 45 octets."""
    said: list[Said] = []
    at = 0.25
    for turn in range(6):
        exchanges = [
            (_crc(1, 3, 0, 100 + turn, 0, 4), _crc(1, 3, 8, 0, turn, 18, 52, 255, 239 - turn, 7, 10)),
            (_crc(2, 4, 0, 3, 0, 1), _crc(2, 4, 2, 6, 16 + turn)),
            (_crc(17, 1, 0, 16, 0, 20), _crc(17, 1, 3, 0x5A, 0x61, turn)),
            (_crc(247, 6, 0, 7, 0x12, 0x30 + turn), _crc(247, 6, 0, 7, 0x12, 0x30 + turn)),
            (_crc(2, 16, 0, 7, 0, 2, 4, 0, 1, 0xAB, turn), _crc(2, 16, 0, 7, 0, 2)),
            (_crc(1, 3, 0x17, 0x70, 0, 1), _crc(1, 0x83, 2) if turn else None),
        ]
        if turn == 3:
            exchanges.append((_crc(17, 3, 0, 1, 0, 20), _crc(17, 3, 40, *range(60, 100))))
        for number, (asked, answer) in enumerate(exchanges):
            said.append(Said(round(at, 6), True, asked))
            wait = 0.020 + 0.001 * number + 0.0007 * len(answer or b"")
            if answer is not None:
                said.append(Said(round(at + wait, 6), False, answer))
            at += 0.137 + 0.011 * number + (0.25 if answer is None else 0.0)
    return said


TALK = _conversation()


@dataclass(frozen=True, slots=True)
class BusLog:
    """A log. `tick`: s by which its times may be off, None where it has none; `only`: whose frames it has, None: all."""

    log: bytes
    tick: float | None
    only: bool | None = None


LOGS: dict[str, BusLog] = {}


def add(name: str, text: str | bytes, tick: float | None = None, only: bool | None = None, enc: str = "utf-8") -> None:
    LOGS[name] = BusLog(text.encode(enc) if isinstance(text, str) else text, tick, only)


def hx(octets: bytes, sep: str = " ", form: str = "{:02X}") -> str:
    return sep.join(form.format(octet) for octet in octets)


def lines(written: Callable[[Said], str]) -> str:
    return "".join(written(one) + "\n" for one in TALK)


def tx(one: Said, yes: str = "TX", no: str = "RX") -> str:
    return yes if one.asks else no


def iso(one: Said, digits: int = 3, sep: str = "T", zone: str = "") -> str:
    return f"{one.time:%Y-%m-%d}{sep}{clock(one, digits)}{zone}"


def clock(one: Said, digits: int = 3, point: str = ".") -> str:
    micro = f"{one.time.microsecond:06d}000"[:digits]
    return f"{one.time:%H:%M:%S}" + (f"{point}{micro}" if digits else "")


def wrapped(octets: bytes, width: int, form: str = "{:02X}") -> list[str]:
    return [hx(octets[at : at + width], " ", form) for at in range(0, len(octets), width)]


def escaped(octets: bytes) -> str:
    return "".join(f"\\x{octet:02x}" for octet in octets)


# -- masters and libraries --------------------------------------------------------------------------------------

add(
    "goburrow",
    lines(
        lambda s: (
            f"{s.time:%Y/%m/%d} {clock(s, 0)} modbus: {tx(s, 'sending', 'received')} {hx(s.octets, ' ', '{:02x}')}"
        )
    ),
    1.0,
)
add(
    "goburrow-us",
    lines(
        lambda s: (
            f"modbus-rtu: {s.time:%Y/%m/%d} {clock(s, 6)} modbus: {tx(s, 'send', 'recv')} {hx(s.octets, ' ', '{:02x}')}"
        )
    ),
    0.00001,
)
add(
    "pino",
    lines(
        lambda s: (
            f'{{"level":20,"time":{s.epoch // 1_000_000},"pid":71,"hostname":"gw","name":"rtu","msg":"{tx(s, "tx", "rx")} {s.octets.hex()}"}}'
        )
    ),
    0.002,
)
add(
    "zap",
    lines(
        lambda s: (
            f'{{"level":"debug","ts":{s.epoch / NS:.6f},"caller":"rtu/port.go:88","msg":"{tx(s, "write", "read")}","data":"{hx(s.octets, " ", "{:02x}")}","len":{len(s.octets)}}}'
        )
    ),
    0.00001,
)
add("serilog", lines(lambda s: f"[{clock(s)} DBG] SerialPort {tx(s, '>>>', '<<<')} {hx(s.octets, '-')}"), 0.002)
add(
    "nmodbus",
    lines(
        lambda s: (
            f"{iso(s, 4, ' ')}|DEBUG|NModbus.IO.ModbusRtuTransport|{tx(s, 'TX', 'RX')}: {', '.join(map(str, s.octets))}"
        )
    ),
    0.001,
)
add(
    "tokio",
    lines(
        lambda s: (
            f'{iso(s, 6, "T", "Z")} TRACE tokio_modbus::codec::rtu: {tx(s, "Encoded", "Decoded")} frame: b"{escaped(s.octets)}"'
        )
    ),
    0.00001,
)
add(
    "env-logger-list",
    lines(lambda s: f"[{iso(s, 0, 'T', 'Z')} DEBUG rmodbus] {tx(s, 'request', 'response')}: {list(s.octets)}"),
    1.0,
)
add(
    "digital-petri",
    lines(
        lambda s: (
            f"{clock(s)} [pool-1-thread-2] TRACE c.d.modbus.SerialPort - {tx(s, 'sendFrame', 'onDataReceived')}: {s.octets.hex().upper()}"
        )
    ),
    0.002,
)
add(
    "jlibmodbus",
    lines(
        lambda s: (
            f"Mar 01, 2026 {s.time:%I:%M:%S %p} com.intelligt.modbus.jlibmodbus.Modbus\nINFO: Frame {tx(s, 'sent', 'recv')}: {hx(s.octets, '', '{:02X}')}"
        )
    ),
    1.0,
)
add(
    "evcc",
    lines(
        lambda s: (
            f"[modbus] TRACE {s.time:%Y/%m/%d} {clock(s, 0)} {tx(s, 'send', 'recv')} {hx(s.octets, ' ', '{:02x}')}"
        )
    ),
    1.0,
)
add(
    "codesys-words",
    lines(
        lambda s: (
            f"{iso(s, 3, ' ')}: {tx(s, 'Request', 'Response')} slave={s.octets[0]} len={len(s.octets)} [{hx(s.octets, ' ', '16#{:02X}')}]"
        )
    ),
    0.002,
)

# -- terminals ----------------------------------------------------------------------------------------------------

add(
    "yat",
    lines(lambda s: f"({clock(s)}) ({tx(s, '<<', '>>')}) {hx(s.octets, ' ', '{:02X}h')} ({len(s.octets)})"),
    0.002,
)
add("hercules", "".join("".join(f"{{{o:02X}}}" for o in s.octets) + "\r\n" for s in TALK))
add("cas-scanner", lines(lambda s: f"{clock(s, 0)}  {tx(s, 'Tx', 'Rx')} [ {hx(s.octets)} ]"), 1.0)
add("modscan", lines(lambda s: "".join(f"[{o:03d}]" for o in s.octets)))
add(
    "simply-modbus",
    "".join(f"request: {hx(s.octets)}\n" if s.asks else f"response: {hx(s.octets)}\r\n\r\n" for s in TALK),
)
add("cutecom", lines(lambda s: f"[{clock(s)}]{tx(s, '>', '')} {hx(s.octets, ' ', '{:02x}')}"), 0.002)
add("tio", lines(lambda s: f"[{clock(s)}] {hx(s.octets, ' ', '{:02x}')}"), 0.002)
add("gtkterm-wrapped", "".join("".join(f"{row} \r\n" for row in wrapped(s.octets, 16)) + "\r\n" for s in TALK))
add("bray-dollar", lines(lambda s: f"{clock(s, 3)}> {hx(s.octets, ' ', '${:02X}')}"), 0.002)
add("modbus-poll-6", lines(lambda s: f"{tx(s, 'Tx', 'Rx')}:{TALK.index(s):06d}-{hx(s.octets)}\r".rstrip("\n")))
add(
    "comtest-tabs",
    lines(
        lambda s: (
            f"{TALK.index(s)}\t{s.time:%d.%m.%Y}\t{clock(s, 3, ',')}\t{tx(s, 'Gesendet', 'Empfangen')}\t{len(s.octets)}\t{hx(s.octets)}"
        )
    ),
    0.002,
)

# -- around logs --------------------------------------------------------------------------------------------------

add(
    "journal-utc-iso",
    lines(lambda s: f"{iso(s, 6)}+0000 gw mbusd[812]: {tx(s, 'TX', 'RX')}: {hx(s.octets, ' ', '{:02x}')}"),
    0.00001,
)
add(
    "journal-json",
    lines(
        lambda s: (
            f'{{"__REALTIME_TIMESTAMP":"{s.epoch // 1000}","_PID":"812","SYSLOG_IDENTIFIER":"mbd","PRIORITY":"7","MESSAGE":"{tx(s, "TX", "RX")}: {hx(s.octets)}"}}'
        )
    ),
    0.00001,
)
add("compose", lines(lambda s: f"mbus-1  | {iso(s, 9, 'T', 'Z')} {tx(s, 'TX', 'RX')}: {hx(s.octets)}"), 0.00001)
add(
    "compose-colours",
    lines(
        lambda s: (
            f"\x1b[36mmbus-1  | \x1b[0m\x1b[90m{iso(s, 3, ' ')}\x1b[0m \x1b[1m{tx(s, '→', '←')}\x1b[0m {hx(s.octets, ' ', '{:02x}')}"
        )
    ),
    0.002,
)
add(
    "kubectl-prefix",
    lines(lambda s: f"[pod/mbus-6d9f7c5b8-x2x9k/mbus] {iso(s, 9, 'T', 'Z')} {tx(s, 'send', 'recv')}: {s.octets.hex()}"),
    0.00001,
)
add(
    "kubectl-klog",
    lines(
        lambda s: (
            f"I{s.time:%m%d} {clock(s, 6)}       1 port.go:88] {tx(s, 'write', 'read')} [{hx(s.octets, ' ', '{:02x}')}]"
        )
    ),
    0.00001,
)
add("moreutils-ts", lines(lambda s: f"{s.time:%b %d %H:%M:%S} {tx(s, '>>', '<<')} {hx(s.octets)}"), 1.0)
add(
    "moreutils-ts-parts",
    lines(
        lambda s: f"{s.time:%H:%M:%S}.{s.time.microsecond:06d} {tx(s, '[TX]', '[RX]')} {hx(s.octets, ' ', '0x{:02x}')}"
    ),
    0.00001,
)
add(
    "logcat-year",
    lines(
        lambda s: (
            f"{s.time:%m-%d} {clock(s)}  1203  1240 D SerialBus: {tx(s, 'write', 'read')} {len(s.octets)} bytes: {hx(s.octets, '')}"
        )
    ),
    0.002,
)
add("epoch-us-bare", lines(lambda s: f"{s.epoch // 1000} {tx(s, 'T', 'R')} {s.octets.hex()}"), 0.00001)
add("epoch-ns-comma", lines(lambda s: f"{s.epoch},{tx(s, 'tx', 'rx')},{s.octets.hex()}"), 0.00001)
add("boot-us", lines(lambda s: f"<{round(s.at * 1e6):>9} us> {tx(s, 'MASTER', 'SLAVE')} {hx(s.octets)}"), 0.00001)
add(
    "american",
    lines(
        lambda s: (
            f"3/{s.time.day}/2026 {s.time:%I:%M:%S}.{s.time.microsecond // 1000:03d} AM - {tx(s, 'Sent', 'Received')}: {hx(s.octets)}"
        )
    ),
    0.002,
)
add(
    "swedish-comma",
    lines(
        lambda s: (
            f"{iso(s, 0, ' ')},{s.time.microsecond // 1000:03d} Skickar {hx(s.octets)}"
            if s.asks
            else f"{iso(s, 0, ' ')},{s.time.microsecond // 1000:03d} Mottaget {hx(s.octets)}"
        )
    ),
    0.002,
)
add("month-by-name", lines(lambda s: f"01-Mar-2026 {clock(s)} [{tx(s, 'TX', 'RX')}] {hx(s.octets)}"), 0.002)

# -- frames over several lines --------------------------------------------------------------------------------------


def _dump(octets: bytes, lead: str = "  ", offset: str = "{:04x}", gap: str = "  ") -> str:
    return "".join(
        f"{lead}{offset.format(at)}{gap}{hx(octets[at : at + 16], ' ', '{:02x}'):<48} {''.join(chr(o) if 32 <= o < 127 else '.' for o in octets[at : at + 16])}\n"
        for at in range(0, len(octets), 16)
    )


add(
    "headed-dumps",
    "".join(
        f"{iso(s, 3, ' ')} {tx(s, 'Outgoing', 'Incoming')} {len(s.octets)} bytes:\n{_dump(s.octets)}" for s in TALK
    ),
    0.002,
)
add(
    "headed-dumps-crlf-tabs",
    "".join(
        f"[{clock(s)}]\t{tx(s, 'Written', 'Read')}\t{len(s.octets)}\n{_dump(s.octets, chr(9), '{:08X}:', ' ')}\n"
        for s in TALK
    ).replace("\n", "\r\n"),
    0.002,
)
add(
    "indented-rows",
    "".join(
        f"{clock(s)} {tx(s)} ({len(s.octets)} bytes)\n" + "".join(f"      {row}\n" for row in wrapped(s.octets, 8))
        for s in TALK
    ),
    0.002,
)
add(
    "multi-line-json",
    "".join(
        '{{\n  "time": "{}",\n  "direction": "{}",\n  "data": "{}"\n}}\n'.format(
            iso(s, 6, "T", "Z"), tx(s, "tx", "rx"), s.octets.hex()
        )
        for s in TALK
    ),
    0.00001,
)
add(
    "yaml-list",
    "".join(f"- t: {s.at:.6f}\n  dir: {tx(s, 'out', 'in')}\n  hex: {hx(s.octets, ' ', '{:02x}')}\n" for s in TALK),
    0.00001,
)
add(
    "processing-repeats",
    "".join(
        f"{iso(s, 3, ' ')} DEBUG {tx(s, 'send', 'recv')}: {hx(s.octets, ' ', '{:#x}')}\n"
        + (
            ""
            if s.asks
            else f"{iso(s, 3, ' ')} DEBUG Processing: {hx(s.octets, ' ', '{:#x}')}\n{iso(s, 3, ' ')} DEBUG Getting Frame - {hx(s.octets[1:-2], ' ', '{:#x}')}\n"
        )
        for s in TALK
    ),
    0.002,
)
add(
    "growing-buffer",
    "".join(
        "".join(f"{clock(s, 6)} buffer: {hx(s.octets[:upto])}\n" for upto in (3, len(s.octets)))
        for s in TALK
        if not s.asks
    ),
    0.00001,
    only=False,
)
add(
    "pieces-one-label",
    "".join(
        f"{clock(s)} {tx(s, 'Send', 'Receive')} {hx(s.octets)}\n"
        if s.asks
        else f"{clock(s)} Receive {hx(s.octets[:5])}\n{clock(s)} Receive {hx(s.octets[5:])}\n"
        for s in TALK
    ),
    0.010,
)
add("truncated-last-line", lines(lambda s: f"{clock(s)} {tx(s)} {hx(s.octets)}")[:-13], 0.002)


# -- each of these was lost once --------------------------------------------------------------------------------

add("ticks-in-hex", lines(lambda s: f"0x{round(s.at * 1e6):08X} {tx(s)} {hx(s.octets)}"))
add("tai64n", lines(lambda s: f"@{(1 << 62) + 10 + s.epoch // NS:016x}{s.epoch % NS:08x} {tx(s)} {hx(s.octets)}"), 1e-5)
add("check-behind-a-bar", lines(lambda s: f"{clock(s)} {tx(s)} {hx(s.octets[:-2])} | {hx(s.octets[-2:])}"), 0.002)
add(
    "fields-by-name",
    lines(
        lambda s: (
            f"{clock(s)} {tx(s)} addr:{s.octets[0]:02X} func:{s.octets[1]:02X} data:{hx(s.octets[2:-2])} crc:{hx(s.octets[-2:])}"
        )
    ),
    0.002,
)
add(
    "kernel-hex-dump",
    "".join(
        f"[{s.at:12.6f}] {tx(s, 'tx', 'rx')}: {at:08x}: {hx(s.octets[at : at + 16], ' ', '{:02x}')}\n"
        for s in TALK
        for at in range(0, len(s.octets), 16)
    ),
    1e-5,
)
add(
    "count-in-a-cell",
    "time;dir;n;b0;b1\n" + lines(lambda s: f"{s.at:.6f};{tx(s)};{len(s.octets)};{hx(s.octets, ';')}"),
    1e-5,
)

add("tabs-within-the-time", lines(lambda s: f"{s.time:%d.%m.%Y}\t{clock(s, 3, ',')}\t{tx(s)}\t{hx(s.octets)}"), 0.002)
add(
    "parts-in-two-groups",
    lines(lambda s: f"[{clock(s)},{s.time.microsecond % 1000:03d}] <dbg> uart: {tx(s)} {hx(s.octets)}"),
    1e-5,
)
add("thread-of-a-trace", lines(lambda s: f"[pid  {80 + s.asks}] {s.epoch / NS:.6f} {tx(s)} {hx(s.octets)}"), 1e-5)
add(
    "export-of-a-journal",
    lines(
        lambda s: (
            f"__REALTIME_TIMESTAMP={s.epoch // 1000}\n__MONOTONIC_TIMESTAMP={round(s.at * 1e6)}\n_PID=81\nMESSAGE={tx(s)}: {hx(s.octets)}\n"
        )
    ),
    1e-5,
)


# -- packets ------------------------------------------------------------------------------------------------------


def _ethernet(one: Said) -> bytes:
    """A segment of TCP between a master and a gateway."""
    ends = (b"\xc0\x00\x02\x05", b"\xc0\x00\x02\x09")
    ports = (40000).to_bytes(2, "big"), (8899).to_bytes(2, "big")
    (source, target), (own, other) = (ends, ports) if one.asks else (ends[::-1], ports[::-1])
    segment = own + other + bytes(8) + b"\x50\x18\x20\x00\x00\x00\x00\x00" + one.octets
    length = (20 + len(segment)).to_bytes(2, "big")
    packet = b"\x45\x00" + length + b"\x00\x01\x00\x00\x40\x06\x00\x00" + source + target + segment
    return b"\x02\x00\x00\x00\x00\x01\x02\x00\x00\x00\x00\x02\x08\x00" + packet


add("tshark-x-of-a-gateway", "".join(f"{_dump(_ethernet(s), '')}\n" for s in TALK))
add(
    "tshark-x-of-a-gateway-with-times",
    "".join(
        f"{number:>5} {s.epoch / NS:.9f} {tx(s, '192.0.2.5', '192.0.2.9')} → {tx(s, '192.0.2.9', '192.0.2.5')} TCP 74 8899\n\n{_dump(_ethernet(s), '')}\n"
        for number, s in enumerate(TALK, 1)
    ),
    1e-5,
)
