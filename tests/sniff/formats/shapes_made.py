"""Shapes in which people have one conversation as a log: what a shape is, and what a reader must make of it."""
# ruff: noqa: E501

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

FRAMES = Path(__file__).parents[3] / "captures" / "logs" / "qmodmaster.frames"
FR = [bytes.fromhex(line) for line in FRAMES.read_text().splitlines()]
ALL = b"".join(FR)
N = len(FR)


@dataclass(frozen=True, slots=True)
class Shape:
    """A log. `octets`: what it tells, None where it is refused or damaged as a whole; `delta`: ns from the first read to the
    second, `first`: ns of the first, None where the shape does not tell; `whole`: whether every line can be understood.
    """

    log: bytes
    octets: bytes | None
    delta: int | None
    whole: bool
    first: int | None


SHAPES: dict[str, Shape] = {}


def add(
    name: str,
    text: str | bytes,
    exp: bytes | None = ALL,
    delta: int | None = None,
    whole: bool = True,
    enc: str = "utf-8",
    first: int | None = None,
) -> None:
    SHAPES[name] = Shape(text.encode(enc) if isinstance(text, str) else text, exp, delta, whole, first)


def hx(octets: bytes, sep: str = " ", form: str = "{:02X}") -> str:
    return sep.join(form.format(octet) for octet in octets)


def lines(written: Callable[[int, bytes], str]) -> str:
    return "\n".join(written(number, frame) for number, frame in enumerate(FR)) + "\n"


def way(number: int) -> str:
    return "TX" if number % 2 == 0 else "RX"


add("line-numbers-space", lines(lambda i, f: f"{i + 1} {hx(f)}"))
add("line-numbers-dot", lines(lambda i, f: f"{i + 1}. {hx(f)}"))
add("line-numbers-colon", lines(lambda i, f: f"{i + 1}: {hx(f)}"))
add("line-numbers-padded", lines(lambda i, f: f"{i + 1:4d}  {way(i)} {hx(f)}"))
add("line-numbers-from-9", lines(lambda i, f: f"{i + 9} {hx(f)}"))
add("line-numbers-00", lines(lambda i, f: f"{i + 1:02d} {hx(f)}"))
add("line-numbers-tab-time", lines(lambda i, f: f"{i + 1}\t10:00:{i:02d}.100\t{way(i)}\t{hx(f)}"))
add("quoted", lines(lambda i, f: f"> {way(i)}: {hx(f)}"))
add("quoted-bare", lines(lambda i, f: f"> {hx(f)}"))
add("quoted-dir", lines(lambda i, f: f"> {'>>>' if i % 2 == 0 else '<<<'} {hx(f)}"))
add(
    "quoted-twice", lines(lambda i, f: f">> [10:00:0{i // 2}.{i % 2 * 500 + 100}] {way(i)}: {hx(f)}"), delta=500_000_000
)
add(
    "markdown-code",
    "Hi all,\nI get this log from my meter and no values:\n\n```\n"
    + lines(lambda i, f: f"{way(i)}: {hx(f)}")
    + "```\nAny help is appreciated, it has address 2 and 9600 baud.\nThanks\n",
)
add("markdown-indent", "Please help\n\n" + lines(lambda i, f: f"    {way(i)}: {hx(f)}") + "\nregards\n")
add("html-entities", lines(lambda i, f: f"{'&gt;&gt;' if i % 2 == 0 else '&lt;&lt;'} {hx(f)}"))
add("bbcode", "[code]\n" + lines(lambda i, f: f"{way(i)}: {hx(f)}") + "[/code]\n")
add(
    "prompt",
    "pi@raspberrypi:~ $ ./sniffer -b 9600 /dev/ttyUSB0\n"
    + lines(lambda i, f: f"{hx(f)}")
    + "^C\npi@raspberrypi:~ $ \n",
)
add(
    "german",
    "Hallo zusammen,\nich habe mal mitgeschnitten, Adresse 2:\n"
    + lines(lambda i, f: f"{'Senden' if i % 2 == 0 else 'Empfangen'}: {hx(f)}")
    + "Schöne Grüße\n",
)
add(
    "german-latin1",
    ("Grüße aus Köln\n" + lines(lambda i, f: f"{'gesendet' if i % 2 == 0 else 'empfangen'}: {hx(f)}")).encode(
        "latin-1"
    ),
)
add("russian", "Добрый день! Лог обмена:\n" + lines(lambda i, f: f"{'Запрос' if i % 2 == 0 else 'Ответ'}: {hx(f)}"))
add(
    "russian-cp1251",
    ("Добрый день! Лог обмена:\n" + lines(lambda i, f: f"{'Запрос' if i % 2 == 0 else 'Ответ'}: {hx(f)}")).encode(
        "cp1251"
    ),
)
add(
    "russian-times",
    lines(
        lambda i, f: f"[28.11.2026 10:00:{i:02d}.100] {'Передача' if i % 2 == 0 else 'Приём'} ({len(f)} байт): {hx(f)}"
    ),
    delta=10**9,
)
add("french", lines(lambda i, f: f"{'Envoi' if i % 2 == 0 else 'Réception'} : {hx(f)}"))
add(
    "chinese",
    lines(lambda i, f: f"[10:00:0{i // 2}.{i % 2 * 500 + 100}]{'发' if i % 2 == 0 else '收'}→◇{hx(f)} □"),
    delta=500_000_000,
)
add(
    "chinese-sscom",
    lines(lambda i, f: f"[10:00:0{i // 2}.{i % 2 * 500 + 100}]{'发→◇' if i % 2 == 0 else '收←◆'}{hx(f)} "),
    delta=500_000_000,
)
add("bom-crlf", "\ufeff" + lines(lambda i, f: f"{way(i)}: {hx(f)}").replace("\n", "\r\n"))
add("utf16le-bom", lines(lambda i, f: f"{way(i)}: {hx(f)}").replace("\n", "\r\n"), enc="utf-16")
add("utf16be-bom", b"\xfe\xff" + lines(lambda i, f: f"{way(i)}: {hx(f)}").encode("utf-16-be"))
add("utf16le-nobom", lines(lambda i, f: f"{way(i)}: {hx(f)}").encode("utf-16-le"))
add("utf16le-nobom-one-line", " ".join(map(hx, FR)).encode("utf-16-le"))
add(
    "line-numbers-of-empty-lines", lines(lambda i, f: f"{2 * i + 1}\t10:00:{i:02d}.100 {way(i)} {hx(f)}\n{2 * i + 2}\t")
)
add("one-line-under-a-letter", "Hello all,\nhere is the log of 12.03.2026.\nRegards, J.\n\n\n" + " ".join(map(hx, FR)))
add("utf16be-nobom", lines(lambda i, f: f"{way(i)}: {hx(f)}").encode("utf-16-be"))
add(
    "utf16-cyrillic",
    "Лог обмена по шине за сегодня\r\n" + lines(lambda i, f: f"{'Запрос' if i % 2 == 0 else 'Ответ'}: {hx(f)}"),
    enc="utf-16",
)
add("nbsp", lines(lambda i, f: f"{way(i)}:\u00a0{hx(f, chr(0xA0))}"))
add("fullwidth-colon", lines(lambda i, f: f"{way(i)}：{hx(f)}"))
add("tabs", lines(lambda i, f: f"{way(i)}\t{hx(f, chr(9))}"))
add("cr-only", lines(lambda i, f: f"{way(i)}: {hx(f)}").replace("\n", "\r"))
add("seconds-bare", lines(lambda i, f: f"{i * 0.5:.3f} {way(i)} {hx(f)}"), delta=500_000_000)
add("seconds-int", lines(lambda i, f: f"{100 + i} {way(i)} {hx(f)}"))
add("ms-bare", lines(lambda i, f: f"{12000 + i * 137} {way(i)} {hx(f)}"), delta=137_000_000)
add("ms-bare-nodir", lines(lambda i, f: f"{12000 + i * 137} {hx(f)}"), delta=137_000_000)
add("ms-bare-colon", lines(lambda i, f: f"{12000 + i * 137}: {hx(f)}"), delta=137_000_000)
add("ms-bracket", lines(lambda i, f: f"[{12000 + i * 137}] {way(i)}: {hx(f)}"), delta=137_000_000)
add("us-bare", lines(lambda i, f: f"{12000000 + i * 137123} {way(i)} {hx(f)}"))
add("epoch-s", lines(lambda i, f: f"{1732788000 + i} {way(i)} {hx(f)}"), delta=10**9, first=1732788000 * 10**9)
add(
    "epoch-s-frac", lines(lambda i, f: f"{1732788000 + i}.250 {way(i)} {hx(f)}"), delta=10**9, first=1732788000250000000
)
add("epoch-ms", lines(lambda i, f: f"{1732788000000 + i * 137} {way(i)} {hx(f)}"), delta=137_000_000)
add("epoch-us", lines(lambda i, f: f"{1732788000000000 + i * 137000} {way(i)} {hx(f)}"), delta=137_000_000)
add("delta-column", lines(lambda i, f: f"+{137 if i else 0} ms {way(i)} {hx(f)}"))
add("iso-z", lines(lambda i, f: f"2024-11-28T10:00:{i:02d}.123456Z {way(i)} {hx(f)}"), delta=10**9)
add(
    "iso-offset",
    lines(lambda i, f: f"2024-11-28T10:00:{i:02d}.123456+02:00 {way(i)} {hx(f)}"),
    delta=10**9,
    first=1732780800123456000,
)
add(
    "ddmm-slash",
    lines(lambda i, f: f"28/11/2024 10:00:{i:02d}.100 {way(i)} {hx(f)}"),
    delta=10**9,
    first=1732788000100000000,
)
add(
    "ddmm-slash-late",
    lines(lambda i, f: f"0{i // 4 + 5}/11/2024 10:00:{i:02d}.100 {way(i)} {hx(f)}").replace("07/11/2024", "13/11/2024"),
)
add("ampm", lines(lambda i, f: f"11/28/2024 1:00:{i:02d}.100 PM {way(i)} {hx(f)}"), delta=10**9)
add("syslog", lines(lambda i, f: f"Nov 28 10:00:{i:02d} raspi modbusd[812]: {way(i)}: {hx(f)}"))
add(
    "journal-short-precise",
    lines(lambda i, f: f"Nov 28 10:00:{i:02d}.123456 raspi modbusd[812]: {way(i)}: {hx(f)}"),
    delta=10**9,
)
add("negative-times", lines(lambda i, f: f"{-3 + i * 0.5:.6f} {way(i)} {hx(f)}"), delta=500_000_000)
add(
    "hms-noms-compact",
    lines(
        lambda i, f: (
            f"100000.{i * 137:03d} {way(i)} {hx(f)}" if i < 7 else f"100001.{i * 137 - 1000:03d} {way(i)} {hx(f)}"
        )
    ),
)
add("h-m-s-letters", lines(lambda i, f: f"10h00m{i:02d}s {way(i)} {hx(f)}"))
add("hh-mm-ss-dash", lines(lambda i, f: f"10-00-{i:02d}.100 {way(i)}: {hx(f)}"), delta=10**9)
add("dmesg", lines(lambda i, f: f"[{1234.5 + i * 0.137:12.6f}] rs485: {way(i)} {hx(f)}"), delta=137_000_000)
add("zephyr", lines(lambda i, f: f"[00:00:{i:02d}.123,456] <dbg> modbus: {way(i)}: {hx(f)}"), delta=10**9)
add("esp-idf", lines(lambda i, f: f"I ({12000 + i * 137}) MB_PORT: {way(i)} {hx(f)}"), delta=137_000_000)
add(
    "esp-idf-buffer",
    lines(
        lambda i, f: "\n".join(
            f"D ({12000 + i * 137}) MB_SERIAL: {hx(f[k : k + 16]).lower()} " for k in range(0, len(f), 16)
        )
    ),
)
add("arduino-monitor", lines(lambda i, f: f"10:00:{i:02d}.123 -> {hx(f)}"), delta=10**9)
add("arduino-unpadded", lines(lambda i, f: f"10:00:{i:02d}.123 -> {' '.join(f'{b:X}' for b in f)}"), delta=10**9)
add("csv-ts-seconds", "ts,dir,data\n" + lines(lambda i, f: f"{i * 0.137:.3f},{way(i)},{hx(f)}"), delta=137_000_000)
add(
    "csv-timestamp_us",
    "timestamp_us,dir,data\n" + lines(lambda i, f: f"{i * 137000},{way(i)},{hx(f)}"),
    delta=137_000_000,
)
add("csv-time_ms", "time_ms;richtung;daten\n" + lines(lambda i, f: f"{i * 137};{way(i)};{hx(f)}"), delta=137_000_000)
add("csv-t-ms-paren", "t (ms),payload_hex\n" + lines(lambda i, f: f"{i * 137},{f.hex()}"), delta=137_000_000)
add("csv-bare-ms", "when,who,bytes\n" + lines(lambda i, f: f"{i * 137 + 1000},{way(i)},{hx(f)}"), delta=137_000_000)
add("csv-noheading-epoch", lines(lambda i, f: f"{1732788000 + i * 0.137:.3f},{way(i)},{hx(f)}"), delta=137_000_000)
add(
    "csv-german-decimal",
    "Zeit;Daten\n" + lines(lambda i, f: f"{i * 0.137:.3f}".replace(".", ",") + f";{hx(f)}"),
    delta=137_000_000,
)
add(
    "csv-iso",
    "timestamp,direction,hex\n" + lines(lambda i, f: f"2024-11-28T10:00:{i:02d}.100Z,{way(i)},{f.hex()}"),
    delta=10**9,
)
add(
    "csv-quoted",
    '"No.","Time","Source","Data"\n' + lines(lambda i, f: f'"{i + 1}","{i * 0.137:.6f}","host","{f.hex()}"'),
    delta=137_000_000,
)
add("csv-nano", "t_ns,data\n" + lines(lambda i, f: f"{i * 137000000},{hx(f)}"), delta=137_000_000)
add("csv-no-time", "id,dir,data\n" + lines(lambda i, f: f"{i},{way(i)},{hx(f)}"))
add("csv-octet-a-row", "time,byte\n" + "".join(f"{(k * 0.00115 + 0):.6f},{b:02X}\n" for k, b in enumerate(ALL)))
bad = lines(lambda i, f: f"{way(i)}: {hx(f)}")
add("bad-octet-last", bad.replace("94 3D", "94 3G"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False)
add(
    "bad-octet-mid",
    bad.replace("25 00 01", "25 0G 01"),
    exp=b"".join(f for i, f in enumerate(FR) if i != 2),
    whole=False,
)
add(
    "bad-octet-q", bad.replace("25 00 01", "25 ?? 01"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False
)
add(
    "bad-octet-first",
    bad.replace("TX: 01 03 01 25", "TX: 0G 03 01 25"),
    exp=b"".join(f for i, f in enumerate(FR) if i != 2),
    whole=False,
)
add(
    "bad-octet-O",
    bad.replace("01 03 01 25 00", "01 03 01 25 O0"),
    exp=b"".join(f for i, f in enumerate(FR) if i != 2),
    whole=False,
)
b0 = lines(lambda i, f: f"{way(i)}: {hx(f, ' ', '0x{:02X}')}")
add("bad-0x", b0.replace("0x01 0x25", "0x01 0x2G"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False)
b1 = lines(lambda i, f: f"{way(i)}: {hx(f, '', '[{:02X}]')}")
add("bad-bracket", b1.replace("[01][25]", "[01][2G]"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False)
b2 = lines(lambda i, f: f"{way(i)}: {hx(f, '')}")
add("bad-joined", b2.replace("01250001", "01250G01"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False)
b3 = lines(lambda i, f: f"{way(i)}: {hx(f, ':')}")
add("bad-colon", b3.replace("01:25:00", "01:25:0G"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False)
b4 = lines(lambda i, f: f"{way(i)}: {', '.join(map(str, f))}")
add(
    "bad-dec", b4.replace(" 37, 0, 1,", " 370, 0, 1,"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False
)
b5 = lines(lambda i, f: f"{way(i)}: {hx(f, '', chr(92) + 'x{:02x}')}")
add("bad-esc", b5.replace("\\x25", "\\x2g"), exp=b"".join(f for i, f in enumerate(FR) if i != 2), whole=False)
add("bad-bare-many", "01 03 0G\n" * 4, exp=None, whole=False)
add("prose-among-labels", "dead beef add\nbe a bad fed\n" + bad + "a bad cab fed\n")
add(
    "prose-among-labels2",
    bad.replace("RX: 01 03 02 06 B6 3A 52", "RX: 01 03 02 06 B6 3A 52\nadd be ad\nbe ad\nde ad be ef\n"),
)
add("prose-date", "Log from 28 11 2024\n" + bad + "Port 1, 9600 8 N 1\n")
add("count-behind", lines(lambda i, f: f"{way(i)}: {hx(f)} {len(f)} bytes"))
add("count-paren", lines(lambda i, f: f"{way(i)} ({len(f):02d}): {hx(f)}"))
add("count-before", lines(lambda i, f: f"{way(i)} {len(f)} {hx(f)}"))
add("count-before-02", lines(lambda i, f: f"{way(i)} {len(f):02d} {hx(f)}"))
add("len-eq", lines(lambda i, f: f"{way(i)} len={len(f)} data={hx(f)}"))
add("pipe-sep", lines(lambda i, f: f"{way(i)}|{hx(f, '|')}"))
add("comma-hex", lines(lambda i, f: f"{way(i)}: {hx(f, ',')}"))
add("semi-hex", lines(lambda i, f: f"{way(i)}: {hx(f, ';')}"))
add("braces", lines(lambda i, f: f"{way(i)}: {{{hx(f, ', ', '0x{:02x}')}}}"))
add("c-array", lines(lambda i, f: f"uint8_t frame{i}[] = {{ {hx(f, ', ', '0x{:02x}')} }};"))
add("py-list-dec", lines(lambda i, f: f"{list(f)}"))
add("py-list-hexstr", lines(lambda i, f: f"{[hex(b) for b in f]}"))
add("py-hex-label", lines(lambda i, f: f"DEBUG:root:{way(i)} {f.hex()}"))
add("py-bytes", lines(lambda i, f: f"{way(i)} {f!r}"))
add("h-suffix", lines(lambda i, f: f"{way(i)} {hx(f, ' ', '{:02X}h')}"))
add("nul-x-upper", lines(lambda i, f: f"{way(i)} {hx(f, ' ', '0X{:02X}')}"))
add("joined-lower", lines(lambda i, f: f"{f.hex()}"))
add("joined-upper-dir", lines(lambda i, f: f"{'-> ' if i % 2 == 0 else '<- '}{f.hex().upper()}"))
add("groups-of-4", lines(lambda i, f: f"{way(i)} {' '.join(f.hex()[k : k + 4] for k in range(0, 2 * len(f), 4))}"))
add("groups-of-8", lines(lambda i, f: f"{way(i)} {' '.join(f.hex()[k : k + 8] for k in range(0, 2 * len(f), 8))}"))
add("frame-no-label", lines(lambda i, f: f"Frame {i + 1}: {hx(f)}"))
add("frame-hash", lines(lambda i, f: f"#{i + 1} {way(i)} {hx(f)}"))
add("stars", lines(lambda i, f: f"*** {way(i)}: {hx(f)} ***"))
add("ascii-col", lines(lambda i, f: f"{way(i)} {hx(f)}  {''.join(chr(b) if 32 <= b < 127 else '.' for b in f)}"))
add("ascii-col-bar", lines(lambda i, f: f"{way(i)} {hx(f)} |{''.join(chr(b) if 32 <= b < 127 else '.' for b in f)}|"))
add(
    "wrapped80",
    "".join(
        (lambda s: "".join(s[k : k + 60] + "\n" for k in range(0, len(s), 60)))(f"{way(i)}: {hx(f)}")
        for i, f in enumerate(FR)
    ),
)
add(
    "wrapped-indent",
    "".join(
        "\n".join([f"{way(i)}: {hx(f[:8])}"] + [f"    {hx(f[k : k + 8])}" for k in range(8, len(f), 8)]) + "\n"
        for i, f in enumerate(FR)
    ),
)
add(
    "wrapped-time",
    "".join(
        "\n".join(
            [f"10:00:{i:02d}.100 {way(i)}: {hx(f[:8])}"]
            + [f"                 {hx(f[k : k + 8])}" for k in range(8, len(f), 8)]
        )
        + "\n"
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)
add("crc-word", lines(lambda i, f: f"{way(i)}: {hx(f)} CRC OK"))
add("crc-behind", lines(lambda i, f: f"{way(i)}: {hx(f)} [CRC {hx(f[-2:], '')}]"))
add("crc-behind2", lines(lambda i, f: f"{way(i)}: {hx(f)} crc=0x{f[-1]:02X}{f[-2]:02X}"))
add("explained-below", lines(lambda i, f: f"{way(i)}: {hx(f)}\n   addr={f[0]} fc={f[1]:02d} crc={hx(f[-2:])}"))
add("node-red", lines(lambda i, f: f"28 Nov 10:00:{i:02d} - [info] [function:log] {way(i)} {hx(f)}"))
add(
    "json-lines",
    lines(lambda i, f: f'{{"ts":{i * 0.137 + 1:.3f},"dir":"{way(i)}","data":"{f.hex()}"}}'),
    delta=137_000_000,
)
add(
    "json-lines-list",
    lines(lambda i, f: f'{{"time":"2024-11-28T10:00:{i:02d}.1Z","dir":"{way(i)}","data":{list(f)}}}'),
    delta=10**9,
)
add(
    "xml",
    "<log>\n" + lines(lambda i, f: f'  <frame time="10:00:{i:02d}.100" dir="{way(i)}">{hx(f)}</frame>') + "</log>\n",
    delta=10**9,
)
add("key-value", lines(lambda i, f: f'time=10:00:{i:02d}.100 level=debug dir={way(i)} bytes="{hx(f)}"'), delta=10**9)
add("android", lines(lambda i, f: f"11-28 10:00:{i:02d}.100  1234  1256 D Modbus  : {way(i)} {hx(f)}"), delta=10**9)
add(
    "log4j",
    lines(lambda i, f: f"2024-11-28 10:00:{i:02d},100 [Thread-3] DEBUG net.wimpi.modbus - {way(i)}: {hx(f).lower()}"),
    delta=10**9,
)
add("jamod", lines(lambda i, f: f"{'Sent' if i % 2 == 0 else 'Response'}: {hx(f).lower()} "))
add(
    "openhab",
    lines(
        lambda i, f: (
            f"2024-11-28 10:00:{i:02d}.100 [TRACE] [dbus.transport.ModbusSerialTransport] - {'Sent' if i % 2 == 0 else 'Last response'}: {' '.join(f'[{b:02X}]' for b in f)}"
        )
    ),
)
add(
    "go-modbus",
    lines(lambda i, f: f"2024/11/28 10:00:{i:02d} modbus: {'sending' if i % 2 == 0 else 'received'} {hx(f).lower()}"),
)
add(
    "rust-debug",
    lines(lambda i, f: f"[2024-11-28T10:00:{i:02d}Z DEBUG tokio_modbus] {way(i)} [{', '.join(f'{b}' for b in f)}]"),
)
add("rust-hex", lines(lambda i, f: f"{way(i)} [{', '.join(f'{b:x}' for b in f)}]"))
add("rust-hex2", lines(lambda i, f: f"{way(i)} [{', '.join(f'{b:#04x}' for b in f)}]"))
add("csharp-bitconverter", lines(lambda i, f: f"{way(i)}: {hx(f, '-')}"))
add(
    "mbpoll-v",
    lines(
        lambda i, f: (
            f"{hx(f, '', '[{:02X}]')}" if i % 2 == 0 else f"Waiting for a confirmation...\n{hx(f, '', '<{:02X}>')}"
        )
    ),
)
add("mixed-short", "TX 02 03\nRX 01\n" + bad, exp=bytes.fromhex("02 03 01") + ALL)
add("two-frames-line", "".join(f"{hx(FR[i])} -> {hx(FR[i + 1])}\n" for i in range(0, N, 2)))
add(
    "table-bars",
    "+----+------+----------+\n| No | Dir  | Data |\n+----+------+---------+\n"
    + lines(lambda i, f: f"| {i + 1} | {way(i)} | {hx(f)} |")
    + "+----+------+\n",
)
add(
    "md-table", "| t | dir | hex |\n|---|---|---|\n" + lines(lambda i, f: f"| 10:00:{i:02d}.1 | {way(i)} | `{hx(f)}` |")
)
add("backticks", lines(lambda i, f: f"{way(i)}: `{hx(f)}`"))
add("bullets", lines(lambda i, f: f"- {way(i)}: {hx(f)}"))
add("bullets-num", lines(lambda i, f: f"{i + 1}) {way(i)}: {hx(f)}"))
add("master-slave-words", lines(lambda i, f: f"{'Master' if i % 2 == 0 else 'Slave'}: {hx(f)}"))
add("arrow-names", lines(lambda i, f: f"{'PC -> Meter' if i % 2 == 0 else 'Meter -> PC'}: {hx(f)}"))
add(
    "xxd-per-frame",
    lines(
        lambda i, f: (
            f"{way(i)}:\n"
            + "\n".join(
                f"{k:08x}: {' '.join(f[k : k + 16].hex()[j : j + 4] for j in range(0, 2 * len(f[k : k + 16]), 4))}  ...."
                for k in range(0, len(f), 16)
            )
        )
    ),
)
add(
    "hexdump-C-each",
    lines(
        lambda i, f: (
            f"10:00:{i:02d}.100 {way(i)} {len(f)} bytes\n"
            + "\n".join(f"  {k:04X}  {hx(f[k : k + 16])}" for k in range(0, len(f), 16))
        )
    ),
    delta=10**9,
)
add(
    "esphome-dbg",
    lines(lambda i, f: f"[10:00:{i:02d}.123][D][uart_debug:114]: {'>>>' if i % 2 == 0 else '<<<'} {hx(f, ':')}"),
    delta=10**9,
)
add(
    "esphome-color",
    lines(
        lambda i, f: (
            f"\x1b[0;36m[10:00:{i:02d}][D][uart_debug:114]: {'>>>' if i % 2 == 0 else '<<<'} {hx(f, ':')}\x1b[0m"
        )
    ),
)
add(
    "ha-around",
    lines(
        lambda i, f: (
            f"2024-11-28 10:00:{i:02d}.123 DEBUG (MainThread) [pymodbus.logging] {'send' if i % 2 == 0 else 'recv'}: {hx(f, ' ', '0x{:x}')}"
        )
    ),
    delta=10**9,
)
add(
    "ha-esphome",
    lines(
        lambda i, f: (
            f"2024-11-28 10:00:{i:02d}.123 DEBUG (MainThread) [homeassistant.components.esphome] meter: [10:00:{i:02d}][D][uart_debug:114]: {'>>>' if i % 2 == 0 else '<<<'} {hx(f, ':')}"
        )
    ),
    delta=10**9,
)
add(
    "pymodbus3",
    lines(
        lambda i, f: (
            f"2024-11-28 10:00:{i:02d},123 DEBUG logging:103 {'send' if i % 2 == 0 else 'recv'}: {hx(f, ' ', '0x{:x}')} extra data: "
        )
    ),
    delta=10**9,
)
add(
    "pymodbus2",
    lines(
        lambda i, f: (
            f"DEBUG:pymodbus.transaction:SEND: {hx(f, ' ', '0x{:x}')}\nDEBUG:pymodbus.client.sync:New Transaction state 'SENDING'"
            if i % 2 == 0
            else f"DEBUG:pymodbus.transaction:RECV: {hx(f, ' ', '0x{:x}')}\nDEBUG:pymodbus.framer.rtu_framer:Getting Frame - {hx(f[1:-2], ' ', '0x{:x}')}\nDEBUG:pymodbus.factory:Factory Response[3]"
        )
    ),
)
add(
    "minimalmodbus1",
    lines(
        lambda i, f: (
            f"MinimalModbus debug mode. Will write to instrument (expecting {len(FR[i + 1])} bytes back): '{''.join(chr(92) + f'x{b:02x}' for b in f)}' ({hx(f)})"
            if i % 2 == 0
            else f"MinimalModbus debug mode. Response from instrument: '{''.join(chr(92) + f'x{b:02x}' for b in f)}' ({hx(f)}) ({len(f)} bytes), roundtrip time: {20 + i}.3 ms. Timeout for reading: 50.0 ms.\n"
        )
    ),
)
add(
    "minimalmodbus2",
    lines(
        lambda i, f: (
            f"MinimalModbus debug mode. Will write to instrument (expecting {len(FR[i + 1])} bytes back): {hx(f)} ({len(f)} bytes)"
            if i % 2 == 0
            else f"MinimalModbus debug mode. Response from instrument: {hx(f)} ({len(f)} bytes), roundtrip time: 0.{i}. Timeout for reading: 0.0.\n"
        )
    ),
)
add(
    "modbus_tk",
    lines(
        lambda i, f: (
            f"2024-11-28 10:00:{i:02d},123\tDEBUG\tmodbus_rtu.send\tThread-1\t{'->' if i % 2 == 0 else '<-'} {'-'.join(str(b) for b in f)}"
        )
    ),
)
add(
    "libmodbus",
    "".join(
        f"{hx(FR[i], '', '[{:02X}]')}\nWaiting for a confirmation...\n{hx(FR[i + 1], '', '<{:02X}>')}\n"
        for i in range(0, N, 2)
    ),
)
add(
    "mbpoll-full",
    "mbpoll 1.4-11 - ModBus(R) Master Simulator\nCopyright (c) 2015-2019 Pascal JEAN, https://github.com/epsilonrt/mbpoll\n\nProtocol configuration: ModBus RTU\nSlave configuration...: address = [2]\n                        start reference = 380, count = 10\nCommunication.........: /dev/ttyUSB0,       9600-8N1\n                        t/o 1.00 s, poll rate 1000 ms\nData type.............: 16-bit register, output (holding) register table\n\nSet debug to TRUE\n"
    + "".join(
        f"-- Polling slave 2...\n{hx(FR[i], '', '[{:02X}]')}\nWaiting for a confirmation...\n{hx(FR[i + 1], '', '<{:02X}>')}\n[380]: \t3801\n[381]: \t61030 (-4506)\n[382]: \t32643\n"
        for i in range(0, N, 2)
    ),
)
add(
    "node-modbus-serial",
    lines(
        lambda i, f: (
            f"2024-11-28T10:00:{i:02d}.123Z modbus-serial {{ action: '{'send serial rtu buffered' if i % 2 == 0 else 'receive serial rtu buffered port'}', data: <Buffer {hx(f).lower()}> }}"
        )
    ),
    delta=10**9,
)
add("modbus-poll-traffic", lines(lambda i, f: f"{'Tx' if i % 2 == 0 else 'Rx'}:{i:06d}-{hx(f)}"))
add("modbus-slave-log", lines(lambda i, f: f"{'Rx' if i % 2 == 0 else 'Tx'}:{i:06d}-{hx(f)} "))
add(
    "qmodmaster",
    lines(lambda i, f: f"[RTU]>{'Tx' if i % 2 == 0 else 'Rx'} > 10:00:{i:02d}:123 - {hx(f, '  ')}  "),
    delta=10**9,
)
add(
    "docklight-hex",
    "Docklight - Version 2.4\n\nDocklight Log File (HEX) - started 28.11.2024 10:00:00.000\n\n"
    + lines(lambda i, f: f"28.11.2024 10:00:{i:02d}.123 [{way(i)}] - {hx(f)} \n"),
    delta=10**9,
)
add(
    "docklight-dec",
    lines(lambda i, f: f"28.11.2024 10:00:{i:02d}.123 [{way(i)}] - {hx(f, ' ', '{:03d}')}"),
    delta=10**9,
)
add(
    "docklight-ascii",
    lines(lambda i, f: f"28.11.2024 10:00:{i:02d}.123 [{way(i)}] - :0103000000027A<CR><LF>"),
    exp=b":0103000000027A\r\n" * N,
)
add("hterm-hex", hx(ALL) + " ")
add("hterm-newline", lines(lambda i, f: hx(f)))
add("hterm-dec", lines(lambda i, f: hx(f, " ", "{:03d}")))
add("realterm-hexspace", hx(ALL) + "\n")
add("realterm-hexcsv", lines(lambda i, f: f"2024/11/28 10:00:{i:02d}, {hx(f, '')}"))
add("coolterm-hex", lines(lambda i, f: f"{hx(f)}     {''.join(chr(b) if 32 <= b < 127 else '.' for b in f)}"))
add("coolterm-ts", lines(lambda i, f: f"2024-11-28 10:00:{i:02d}.123\t{hx(f)}"), delta=10**9)
add(
    "putty-raw",
    "=~=~=~=~=~=~=~=~=~=~=~= PuTTY log 2024.11.28 10:00:00 =~=~=~=~=~=~=~=~=~=~=~=\r\n"
    + "".join(
        f"{'Outgoing' if i % 2 == 0 else 'Incoming'} raw data at 2024-11-28 10:00:{i:02d}\r\n"
        + "".join(f"  {k:08x}  {hx(f[k : k + 16]).lower()}  ...\r\n" for k in range(0, len(f), 16))
        for i, f in enumerate(FR)
    ),
)
add("minicom-hex", lines(lambda i, f: " ".join(f"{b:02x}" for b in f)))
add("minicom-ts", lines(lambda i, f: f"[2024-11-28 10:00:{i:02d}.123] {' '.join(f'{b:02x}' for b in f)}"), delta=10**9)
add("teraterm-debug", lines(lambda i, f: f"[2024-11-28 10:00:{i:02d}.123] {hx(f)} "), delta=10**9)
add(
    "interceptty",
    "".join(
        "".join(f"{'>' if i % 2 == 0 else '<'} 0x{b:02x} ({chr(b) if 32 < b < 127 else '^@'})\n" for b in f)
        for i, f in enumerate(FR)
    ),
)
add(
    "eltima-text",
    "".join(
        f"[28/11/2024 10:00:{i:02d}] {'Written' if i % 2 == 0 else 'Read'} data (COM3)\n    {hx(f).lower()}                         ....\n"
        for i, f in enumerate(FR)
    ),
)
add(
    "eltima-table",
    lines(
        lambda i, f: (
            f"#{i + 1}\t28.11.2024 10:00:{i:02d}\t{'IRP_MJ_WRITE' if i % 2 == 0 else 'IRP_MJ_READ'}\tUP\tSTATUS_SUCCESS\t{hx(f).lower()}\t....\t{len(f)}\tCOM3"
        )
    ),
)
add(
    "hhd-dump",
    "".join(
        f"{i + 1:06d}: 2024-11-28 10:00:{i:02d}.1234567 +0.0123456\n\n{'IRP_MJ_WRITE' if i % 2 == 0 else 'IRP_MJ_READ'} - Request completed\n"
        + "".join(f" {hx(f[k : k + 16]).lower():48}  ................\n" for k in range(0, len(f), 16))
        + "\n"
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)
add(
    "hhd-free-serial",
    "".join(
        f"Request: 28.11.2024 10:00:{i:02d}.12345 (+1.0000 seconds)\n\n {hx(f)}   ....\n\n"
        if i % 2 == 0
        else f"Answer: 28.11.2024 10:00:{i:02d}.12345 (+1.0000 seconds)\n\n"
        + "".join(f" {hx(f[k : k + 16])}   ................\n" for k in range(0, len(f), 16))
        + "\n"
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)
add(
    "ioninja",
    "".join(
        f"{'<<' if i % 2 == 0 else '>>'} 10:00:{i:02d}.123 +1.000\n"
        + "".join(f"   {k:04x}  {hx(f[k : k + 16]).lower():48} ....\n" for k in range(0, len(f), 16))
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)
add(
    "tshark-x",
    "".join(
        "".join(f"{k:04x}  {hx(f[k : k + 16]).lower():48}  ....\n" for k in range(0, len(f), 16)) + "\n"
        for i, f in enumerate(FR)
    ),
)
add(
    "tshark-x-summary",
    "".join(
        f"{i + 1} {i * 0.137:.6f}  1 → 2  Modbus RTU {len(f)} \n\n"
        + "".join(f"{k:04x}  {hx(f[k : k + 16]).lower():48}  ....\n" for k in range(0, len(f), 16))
        + "\n"
        for i, f in enumerate(FR)
    ),
    delta=137_000_000,
)
add("tshark-fields", lines(lambda i, f: f"{i + 1}\t{i * 0.137:.9f}\t{f.hex()}"), delta=137_000_000)
add("sigrok-ann", lines(lambda i, f: "\n".join(f"uart-1: {b:02X}" for b in f)))
add(
    "sigrok-samples",
    "".join(f"{1000 + k * 1042}-{1000 + k * 1042 + 833} uart-1: RX: {b:02X}\n" for k, b in enumerate(ALL)),
)
add(
    "pulseview-export",
    "".join(f"{k * 1042 + 100}-{k * 1042 + 933} UART: RX data: {b:02X}\n" for k, b in enumerate(ALL)),
)
add(
    "dsview-csv",
    "Id,Time[ns],0:UART: RX/TX\n" + "".join(f"{k + 1},{k * 1042000 + 100},{b:02X}\n" for k, b in enumerate(ALL)),
)
add(
    "csv-saleae1-hex",
    "Time [s],Value,Parity Error,Framing Error\n"
    + "".join(f"{k * 0.00115:.9f},0x{b:02X},,\n" for k, b in enumerate(ALL)),
)
add(
    "csv-saleae1-dec",
    "Time [s],Value,Parity Error,Framing Error\n" + "".join(f"{k * 0.00115:.9f},{b},,\n" for k, b in enumerate(ALL)),
)
add(
    "csv-saleae1-char",
    "Time [s],Value,Parity Error,Framing Error\n" + "".join(f"{k * 0.00115:.9f},'{b}',,\n" for k, b in enumerate(ALL)),
)
add(
    "csv-saleae2",
    'name,type,start_time,duration,"data"\n'
    + "".join(f'"Async Serial","data",{k * 0.00115:.9f},0.00104,0x{b:02X}\n' for k, b in enumerate(ALL)),
)
add(
    "csv-saleae2-iso",
    'name,type,start_time,duration,"data"\n'
    + "".join(
        f'"Async Serial","data",2024-11-28T10:00:{k * 0.00115:012.9f}+00:00,0.00104,0x{b:02X}\n'
        for k, b in enumerate(ALL)
    ),
)
USBMON = [
    f"ffff88003719c240 {3575914555 + i * 50000} {'S Bo:1:005:2 -115' if i % 2 == 0 else 'C Bi:1:005:1 0'} "
    f"{len(f) + 2 * (i % 2)} = {(bytes([1, 0x60]) * (i % 2) + f).hex(' ', -4)}\n"
    f"ffff88003719c300 {3575914655 + i * 50000} C Bi:1:005:1 0 2 = 0160\n"
    for i, f in enumerate(FR)
]
add("usbmon-ftdi", "".join(USBMON), delta=50_000_000)
DOTTED = ["02.03.00.0A.00.02.E4.3A", "02.03.04.00.01.00.07.99.31", "03.03.00.0B.00.02.B4.2B", "01.03.00.0C.00.02.04.08"]
add("dots-that-look-like-a-clock", "\n".join(DOTTED) + "\n", bytes.fromhex("".join(DOTTED).replace(".", "")))
ANSWER = bytes.fromhex("03030400280029285b")
add(
    "slsnif-brackets",
    "Opened /dev/ttyS0; fd=4\n"
    + "".join(
        f"{who} --> {''.join(f'{chr(b)}({b:03d})' if 32 < b < 127 else f'({b:03d})' for b in ANSWER)}\n"
        for who in ("Host  ", "Device") * 8
    ),
    ANSWER * 16,
)
add("saleae-txt", "Time[s],Value\n" + "".join(f"{k * 0.00115:.9f},{b:02X}\n" for k, b in enumerate(ALL)))
add("py-bytearray", lines(lambda i, f: f"{way(i)}: {bytearray(f)!r}"))
add("py-print-hexlify", lines(lambda i, f: f"b'{f.hex()}'"))
add("py-hexlify-label", lines(lambda i, f: f"{'send' if i % 2 == 0 else 'received'} b'{f.hex()}'"))
add("py-hex-sep", lines(lambda i, f: f"INFO:__main__:{way(i)}: {f.hex(' ')}"))
add("java-tostring", lines(lambda i, f: f"{way(i)} {[b - 256 if b > 127 else b for b in f]}"))
add("csharp-x2", lines(lambda i, f: f"[{way(i)}] 0x{f.hex().upper()}"))
add("delphi", lines(lambda i, f: f"{way(i)}: ${hx(f, ' $')}"))
add("pascal-hash", lines(lambda i, f: f"{way(i)}: #{'#'.join(str(b) for b in f)}"))
add(
    "ascii-modbus-lines",
    ":020300000002F9\r\n:0203040000000CEB\r\n" * 3,
    exp=b":020300000002F9\r\n:0203040000000CEB\r\n" * 3,
)
add(
    "ascii-labelled",
    "TX: :020300000002F9\nRX: :0203040000000CEB\n" * 3,
    exp=b":020300000002F9\r\n:0203040000000CEB\r\n" * 3,
)
add("docker", lines(lambda i, f: f"modbus_1  | 2024-11-28T10:00:{i:02d}.123456789Z {way(i)}: {hx(f)}"), delta=10**9)
add("k8s", lines(lambda i, f: f"2024-11-28T10:00:{i:02d}.123456789Z stdout F {way(i)} {hx(f)}"), delta=10**9)
add(
    "zigbee2mqtt-like",
    lines(lambda i, f: f"[2024-11-28 10:00:{i:02d}] debug: \tz2m: {way(i)} [{','.join(str(b) for b in f)}]"),
)
add(
    "openwrt-logread",
    lines(lambda i, f: f"Thu Nov 28 10:00:{i:02d} 2024 daemon.debug mbusd[1234]: {way(i)}: {hx(f, '', '[{:02x}]')}"),
)
add(
    "mbusd",
    lines(
        lambda i, f: (
            f"28 Nov 2024 10:00:{i:02d} {'tty: written' if i % 2 == 0 else 'tty: response'}: {hx(f, '', '[{:02x}]')}"
        )
    ),
    delta=10**9,
)
add("mbusd2", lines(lambda i, f: f"[10:00:{i:02d}] {hx(f, '', ' {:02x}')} "))
add(
    "wb-mqtt-serial",
    lines(lambda i, f: f"DEBUG: [port] /dev/ttyRS485-1: {'Write' if i % 2 == 0 else 'ReadFrame'}: {hx(f).lower()}"),
)
add(
    "wb-mqtt-serial2",
    lines(lambda i, f: f"2024-11-28 10:00:{i:02d} DEBUG: [modbus] {'>>' if i % 2 == 0 else '<<'} {hx(f).lower()}"),
)
add(
    "iobroker",
    lines(
        lambda i, f: (
            f"2024-11-28 10:00:{i:02d}.123  - debug: modbus.0 (1234) {'Sending' if i % 2 == 0 else 'Received'}: {f.hex()}"
        )
    ),
    delta=10**9,
)
add(
    "fhem",
    lines(lambda i, f: f"2024.11.28 10:00:{i:02d} 5: Modbus: {'Send' if i % 2 == 0 else 'ParseFrameStart'} {f.hex()}"),
)
add(
    "fhem2",
    lines(
        lambda i, f: (
            f"2024.11.28 10:00:{i:02d}.123 4: MB: {'HandleSendQueue sends' if i % 2 == 0 else 'ReadFn got'} {f.hex()}"
        )
    ),
    delta=10**9,
)
add("loxone", lines(lambda i, f: f"2024-11-28 10:00:{i:02d};{way(i)};{hx(f)}"))
add("tasmota", lines(lambda i, f: f"10:00:{i:02d}.123 MBR: {'Tx' if i % 2 == 0 else 'Rx'} {hx(f, '')}"), delta=10**9)
add(
    "tasmota-json",
    lines(lambda i, f: f'10:00:{i:02d}.123 MQT: tele/x/RESULT = {{"ModbusReceived":{{"RawData":"{f.hex()}"}}}}'),
    delta=10**9,
)
add(
    "csv-semicolon-german",
    "Nr.;Zeitstempel;Richtung;Länge;Daten\n"
    + lines(
        lambda i, f: f"{i + 1};28.11.2024 10:00:{i:02d},123;{'Senden' if i % 2 == 0 else 'Empfang'};{len(f)};{hx(f)}"
    ),
    delta=10**9,
)
add(
    "csv-tab",
    "No\tTime\tDir\tBytes\n" + lines(lambda i, f: f"{i + 1}\t10:00:{i:02d}.123\t{way(i)}\t{hx(f)}"),
    delta=10**9,
)
add(
    "csv-tab-len",
    "No\tTime\tDir\tLen\tPayload\n" + lines(lambda i, f: f"{i + 1}\t10:00:{i:02d}.123\t{way(i)}\t{len(f)}\t{hx(f)}"),
    delta=10**9,
)
add("csv-excel-sep", "sep=;\nTime;Data\n" + lines(lambda i, f: f"10:00:{i:02d}.123;{hx(f)}"), delta=10**9)
add(
    "wireshark-csv",
    '"No.","Time","Source","Destination","Protocol","Length","Info"\n"1","0.0","a","b","Modbus","8","Query"\n',
    exp=None,
)
add("html-pre", "<pre>\n" + lines(lambda i, f: f"{way(i)}: {hx(f)}<br>") + "</pre>\n")
add("whatsapp", lines(lambda i, f: f"[28.11.24, 10:00:{i:02d}] Max: {hx(f)}"))
add(
    "mail-quoted-deep",
    "On Thu, Nov 28, 2024 at 10:00 AM Max <max@example.com> wrote:\n> Hi,\n> here it is:\n>\n"
    + lines(lambda i, f: f"> {way(i)}: {hx(f)}")
    + ">\n> Max\nThe answer is clear.\n",
)
add("mail-quoted-bare", "Max wrote:\n> Hi,\n> here it is:\n>\n" + lines(lambda i, f: f"> {hx(f)}") + ">\n> Max\n")
add(
    "soft-wrapped-no-indent",
    "".join(
        (lambda s: s[:40] + "\n" + s[40:] + "\n" if len(s) > 40 else s + "\n")(f"{way(i)}: {hx(f)}")
        for i, f in enumerate(FR)
    ),
)
add(
    "soft-wrap-mid-octet",
    "".join(
        (lambda s: s[:41] + "\n" + s[41:] + "\n" if len(s) > 41 else s + "\n")(f"{way(i)}: {hx(f)}")
        for i, f in enumerate(FR)
    ),
)
add(
    "backslash-wrap",
    "".join(
        f"{way(i)}: {hx(f[:8])} \\\n    {hx(f[8:])}\n" if len(f) > 8 else f"{way(i)}: {hx(f)}\n"
        for i, f in enumerate(FR)
    ),
)
add(
    "truncated-dots",
    "".join(f"{way(i)}: {hx(f[:16])} ...\n" if len(f) > 16 else f"{way(i)}: {hx(f)}\n" for i, f in enumerate(FR)),
    exp=b"".join(f[:16] for f in FR),
    whole=False,
)
add("ellipsis", "".join(f"{way(i)}: {hx(f)}\n" for i, f in enumerate(FR)) + "...\n")
add("timestamps-behind", lines(lambda i, f: f"{hx(f)}   10:00:{i:02d}.123"), delta=10**9)
add("dir-behind", lines(lambda i, f: f"{hx(f)}  ({way(i)})"))
add("dir-behind2", lines(lambda i, f: f"10:00:{i:02d}.123 {hx(f)} {way(i)}"), delta=10**9)
add("size-in-brackets", lines(lambda i, f: f"{way(i)}[{len(f)}]: {hx(f)}"))
add("idx-octets", "".join("".join(f"buf[{k}] = 0x{b:02X}\n" for k, b in enumerate(f)) for f in FR))
add("idx-octets2", "".join("".join(f"rx[{k}]: {b:02X}\n" for k, b in enumerate(f)) for f in FR))
add("idx-octets-dec", "".join("".join(f"byte {k}: {b}\n" for k, b in enumerate(f)) for f in FR))
add("arduino-println-HEX", "".join("".join(f"{b:X}\n" for b in f) for f in FR))
add("arduino-println-dec", "".join("".join(f"{b}\n" for b in f) for f in FR))
add(
    "arduino-serialmonitor-octets",
    "".join("".join(f"10:00:{i:02d}.{100 + k:03d} -> {b:02X}\n" for k, b in enumerate(f)) for i, f in enumerate(FR)),
)
add("arduino-0x", lines(lambda i, f: "".join(f"0x{b:X} " for b in f)))
add("arduino-hex-unpadded", lines(lambda i, f: "".join(f"{b:X} " for b in f)))
add("arduino-hex-unpadded-lower", lines(lambda i, f: f"{way(i)}: " + "".join(f"{b:x} " for b in f)))
add("arduino-dec-comma", lines(lambda i, f: ",".join(f"{b}" for b in f)))
add(
    "arduino-dec-space-label",
    lines(lambda i, f: f"{'Request' if i % 2 == 0 else 'Response'}: " + " ".join(f"{b}" for b in f)),
)
add("zero-octet-log", "TX: \x00\n" + lines(lambda i, f: f"{way(i)}: {hx(f)}"))
add(
    "very-long-label",
    lines(
        lambda i, f: (
            f"com.example.industrial.modbus.transport.serial.SerialPortTransport$Worker.run(SerialPortTransport.java:123) {way(i)}: {hx(f)}"
        )
    ),
)
add("port-names", lines(lambda i, f: f"COM3 {way(i)}: {hx(f)}"))
add("port-tty", lines(lambda i, f: f"/dev/ttyUSB0 {'>>' if i % 2 == 0 else '<<'} {hx(f)}"))
add("ip-label", lines(lambda i, f: f"192.168.1.10:502 {'->' if i % 2 == 0 else '<-'} {hx(f)}"))
add("mac-label", lines(lambda i, f: f"00:1a:2b:3c:4d:5e {way(i)} {hx(f)}"))
add("uuid-label", lines(lambda i, f: f"id=550e8400-e29b-41d4-a716-446655440000 {way(i)} {hx(f)}"))
add("pid-bracket", lines(lambda i, f: f"[{12345}] {way(i)} {hx(f)}"))
add("hex-addr-label", lines(lambda i, f: f"0x7ffd1234 {way(i)} {hx(f)}"))
add("thread-id", lines(lambda i, f: f"10:00:{i:02d}.123 [12] {way(i)} {hx(f)}"), delta=10**9)
add("thread-id2", lines(lambda i, f: f"10:00:{i:02d}.123 12 {way(i)} {hx(f)}"), delta=10**9)
add("slave-id", lines(lambda i, f: f"slave {f[0]} {way(i)} {hx(f)}"))
add("slave-id2", lines(lambda i, f: f"{way(i)} slave=02 fc=03 data: {hx(f)}"))
add("slave-id3", lines(lambda i, f: f"{way(i)} 02 03: {hx(f)}"))
add("baud-header", "9600,8,N,1\n" + lines(lambda i, f: f"{way(i)} {hx(f)}"))
add("ms-step-paren", lines(lambda i, f: f"(+{100 + i} ms) {way(i)} {hx(f)}"))
add("delta-steps", lines(lambda i, f: f"{0.1 + (i * 7 % 5) * 0.013:.3f} {way(i)} {hx(f)}"))


# -- each of these was lost once --------------------------------------------------------------------------------

add("underscores", lines(lambda i, f: f"10:00:{i:02d}.100 {way(i)} {hx(f, '_')}"), delta=10**9)
add(
    "csv-octet-a-cell",
    "Timestamp;Direction;Data\n" + lines(lambda i, f: f"10:00:{i:02d}.100;{way(i)};{hx(f, ';', '0x{:02X}')}"),
    delta=10**9,
)
add(
    "csv-octet-a-cell-numbered",
    "ms,dir,data,1,2,3\n" + lines(lambda i, f: f"{i * 137 + 5},{way(i)},{hx(f, ',', '{}')}"),
    delta=137_000_000,
)
add(
    "csv-saleae1-two-analysers",
    "Time [s],Analyzer Name,Decoded Protocol Result\n"
    + "".join(f"{k * 0.00115:.9f},Async Serial,0x{b:02X}\n" for k, b in enumerate(ALL)),
    delta=1_150_000,
)
add(
    "csv-unit-in-the-cell",
    "Id,Time,0:UART\n" + "".join(f"{k},{k * 1150000:.2f}ns,{b:02X}\n" for k, b in enumerate(ALL)),
    delta=1_150_000,
)
add(
    "gateway-page",
    lines(lambda i, f: f"Pkt({i}): 001:14:03:{i:02d}.100 {way(i)[0]}x:{hx(f, ' ', '{:02x}h')}"),
    delta=10**9,
)
add("label-and-clock", lines(lambda i, f: f"{i:06d}-Tx:14:03:{i:02d}.100-{hx(f)}"), delta=10**9)
add(
    "decimals-in-brackets",
    lines(lambda i, f: f"{'Host   -->' if i % 2 == 0 else 'Device -->'} {hx(f, ' ', '({:03d})')}"),
)
add(
    "plus-clock",
    lines(lambda i, f: f"+00:{i:02d}.137 {'<' if i % 2 == 0 else '>'} {hx(f, ' ', '{:02x}')}"),
    delta=10**9,
)
add(
    "accent-within-characters",
    r"""TX: b'\x02\x04`\x01`\xff`'""" + "\n" + r"""RX: b'`\x04#\x20 `'""" + "\n",
    exp=b"\x02\x04`\x01`\xff``\x04#  `",
)
add(
    "calls-that-took-long",
    lines(
        lambda i, f: (
            f"{i}\t0.0000{i + 11}\tscan.exe\tIRP_MJ_{'WRITE' if i % 2 == 0 else 'READ'}\tSerial0\tSUCCESS\tLength {len(f)}: {hx(f)}"
        )
    ),
)
add(
    "answers-with-their-time",
    lines(lambda i, f: f"{way(i)} {hx(f)}" + (f" roundtrip time: {i % 5}.3 ms" if i % 2 else "")),
)
add(
    "octet-a-line-ms",
    "".join(f"{k * 1.146:.3f} {b:02X}\n" for k, b in enumerate(ALL)),
    delta=1_146_000,
)
add(
    "json-short",
    "".join(
        f'{{"ts": "2024-05-02T14:03:{i:02d}.100Z", "data": "{f.hex()}"}}\n'
        for i, f in enumerate([*FR, b"\x11\x83\x02\xc1\x34"])
    ),
    exp=ALL + b"\x11\x83\x02\xc1\x34",
    delta=10**9,
)
add(
    "broken-behind-three",
    lines(lambda i, f: f"10:00:{i:02d}.100 {way(i)} {hx(f)}")
    + "10:00:59.100 TX "
    + hx(FR[0][:3])
    + " 0G "
    + hx(FR[0][4:])
    + "\n",
    whole=False,
    delta=10**9,
)
add(
    "object-over-lines",
    "".join(
        f"2024-05-02T14:03:{i:02d}.100Z serial {{\n  action: 'send',\n  data: <Buffer {hx(f, ' ', '{:02x}')}>,\n  unitid: 1\n}}\n"
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)
add(
    "headed-by-four-lines",
    "".join(
        f"[23/10/2008 10:00:{i:02d}]\n{i} IRP_MJ_{'WRITE' if i % 2 == 0 else 'READ'} - transfers data (COM5)\n   STATUS_SUCCESS\n         {hx(f[:16])}   ........\n{'         ' + hx(f[16:]) + chr(10) if len(f) > 16 else ''}{'-' * 60}\n"
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)


def _rows(frame: bytes) -> str:
    return "".join(
        f"  | {at:04X}: {hx(frame[at : at + 8])}  {hx(frame[at + 8 : at + 16]):<24} |{'.' * len(frame[at : at + 16])}|\n"
        for at in range(0, len(frame), 16)
    )


add(
    "dumps-that-repeat",
    "".join(
        f"[D] {1000 + 137 * i}| x.cpp [ 12] go\n[D] Sent packet: @3FFD32E0/{len(f) - 2}:\n{_rows(f[:-2])}"
        if i % 2 == 0
        else f"[V] {1000 + 137 * i}| x.cpp [ 89] in\n[D] Raw buffer received: @3FFD2454/{len(f)}:\n{_rows(f)}"
        f"[D] Received packet: @3FFBC880/{len(f) - 2}:\n{_rows(f[:-2])}[V] Data: @3FFBC880/7:\n{_rows(f[:-2])}"
        for i, f in enumerate(FR)
    ),
    delta=137_000_000,
)


add(
    "numbered-with-a-cross",
    "".join(
        f"#{i} 10:00:{i:02d}.100 {'WRITE' if i % 2 == 0 else 'READ'}: Length: {len(f)}\n{hx(f)}\n"
        for i, f in enumerate(FR)
    ),
    delta=10**9,
)
add(
    "microseconds-in-brackets",
    lines(lambda i, f: f"[{i * 137123:>10}] {way(i)}: {hx(f, ' ', '{:02x}')}") * 1,
    delta=137_123_000,
)
add("microseconds-by-name", lines(lambda i, f: f"T={i * 13700123} {way(i)} {hx(f)}"), delta=13_700_123_000)
add(
    "numbers-before-digits-without-space",
    lines(lambda i, f: f"10:00:{i:02d}.100 {way(i)}: slave={f[0] + 16} fc={f[1]} raw={f.hex()}"),
    delta=10**9,
)
add(
    "station-behind-octets",
    "".join(
        "".join(f"{1000 * i + 12 * k}-{1000 * i + 12 * k + 8} uart-1: {b:02X}\n" for k, b in enumerate(f))
        + f"{1000 * i}-{1000 * i + 9} modbus-1: Slave ID: 17\n"
        for i, f in enumerate(FR)
    ),
)
