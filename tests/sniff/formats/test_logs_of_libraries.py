"""Logs of libraries in which the same octets stand again and again, beside others: each is read once, and none left."""
# ruff: noqa: E501

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from sniff.analysis.told_protocol import detected
from sniff.bus.offline import settled
from sniff.engine.capture import CaptureError
from sniff.formats import read

A, R = "07 04 00 10 00 02 70 68", "07 04 04 00 EB 01 2C ED FD"
A2, R2 = "07 04 00 12 00 02 D1 A8", "07 04 04 01 5A 00 63 FC 42"
CUT = R2[:-3]


def low(text: str, between: str = " ") -> str:
    return text.lower().replace(" ", between)


def hexed(text: str) -> str:
    return " ".join(f"{int(pair, 16):#x}" for pair in text.split())


def escaped(text: str) -> str:
    return "".join(f"\\x{pair.lower()}" for pair in text.split())


def bracketed(text: str) -> str:
    return f"[{low(text, '][')}]"


def forum() -> str:
    return (
        f"Hello,\n\nmy meter does not answer. The master sends:\n\n{A}\n\nand the slave (with the sketch of the library) says\n\n"
        f"{R}\n\nThat is strange, I changed the address and the rate and had no success. Do you have an idea?\n\nThanks!\n"
    )


def jsmodbus() -> str:
    pieces = [low(R)[:2], low(R)[:17], low(R)]
    head = f"  client-request-handler flushing new request <Buffer {low(A)}> +1ms\n  serialport:bindings write 8 bytes +98ms\n"
    return head + "".join(
        f"  modbus-client received data +6ms\n  rtu-response-handler buffer <Buffer {piece}> +1ms\n"
        f"  rtu-response address 7 buffer <Buffer {piece}> +0ms\n  rtu-response crc NaN +2ms\n"
        for piece in pieces
    )


def pymodbus_echo() -> str:
    at, log = "2025-03-03 16:34:0", ""
    for number, (asked, answered) in enumerate(((A, R), (A2, R2))):
        for text in (asked, f"{asked} {answered}"):
            log += f"{at}{number},650 MainThread      DEBUG    base           :91       Processing: {hexed(text)}\n"
            log += f"{at}{number},651 MainThread      DEBUG    decoders       :84       Decoded PDU function_code(4 sub -1)\n"
        log += ">>> RESULT: ReadInputRegistersResponse(dev_id=7, registers=[235, 300], status=1)\n\n"
    return log


def tokio() -> str:
    log = ""
    for number in range(1, 10):
        octets = escaped(R[: 3 * number].strip())
        at = f"[2020-05-19T11:37:31.{390 + number}Z TRACE tokio_modbus::codec::rtu]"
        log += f'{at} ClientCodec::decode(b"{octets}")\n{at} --- decode b"{octets}"\n{at} PDU len is None\n'
        log += f'{at} get_response_pdu_len b"{octets}"\n' if number < 3 else ""
    return log


def minimalmodbus() -> str:
    log = "16:23:59 08/17/17 CEST\n\n"
    for number, (asked, answered) in enumerate(((A, R), (A2, CUT), (A, R))):
        log += (
            f"MinimalModbus debug mode. Writing to instrument (expecting 9 bytes back): '{escaped(asked)}' ({asked})\n"
        )
        log += f"MinimalModbus debug mode. No sleep required before write. Time since previous read: {1003 + number}.7 ms.\n"
        log += f"MinimalModbus debug mode. Response from instrument: '{escaped(answered)}' ({answered}) (9 bytes), "
        log += f"roundtrip time: {41 - 13 * number}.7 ms. Timeout setting: 1100.0 ms.\n\nexception\n\n"
    return log


def minimalmodbus_errors() -> str:
    return "".join(
        f"paź 2{day} 20:41:46 host python[4755]: minimalmodbus.InvalidResponseError: Checksum error in rtu mode: '\\x08þ' "
        f"instead of '{{±' . The response is: '{escaped(answered)}' (plain response: '{escaped(answered)}')\n"
        for day, answered in enumerate((R, R2))
    )


def mbusd() -> str:
    log = ""
    for asked, answers in ((A, (R,)), (A2, (CUT, R2))):
        log += f"05 Mar 2021 18:12:35 conn[192.168.40.39]: request: {bracketed(asked[:-6])}\n"
        for answer in answers:
            is_good = answer != CUT
            log += f"05 Mar 2021 18:12:35 tty: response is incorrect: {bracketed(answer)}\n" * (not is_good)
            log += "05 Mar 2021 18:12:35 tty: attempt to retry request (1 of 3)\n" * (not is_good)
            log += f"05 Mar 2021 18:12:35 tty: response: {bracketed(answer)}\n" * is_good
        log += f"05 Mar 2021 18:12:35 conn[192.168.40.39]: response: {bracketed(answers[-1][:-6])}\n"
    return log


def names_with_values() -> str:
    told = (("REQUEST", A), ("RESPONSE", R), ("REQUEST", A2), ("RESPONSE", R2), ("REQUEST", A2))
    log = "".join(
        f"DATE=2019-05-15T14:58:42.{10 + 20 * number:03};TYPE={kind};FRAME={low(text, '-')};SLAVE=7;FC=4\n"
        for number, (kind, text) in enumerate(told)
    )
    log += f"DATE=2019-05-15T14:58:42.117;ERR=BAD_CRC;FRAME={low(CUT, '-')};SLAVE=7\n"
    return log + "DATE=2019-05-15T14:58:42.150;ERR=SHORT_FRAME;FRAME=ff;SLAVE=255\n"


def doubled() -> str:
    log = ""
    for number, (asked, answered) in enumerate(((A, R), (A2, R2))):
        at = f"2023-09-14 14:37:{19 + number}"
        log += f"{at}.766 DEBUG (MainThread) [pymodbus.logging] send: {hexed(asked)}\n"
        log += f"{at}.957 DEBUG (MainThread) [pymodbus.logging] recv: {hexed(answered)}\n" * 2
        log += f"{at}.958 DEBUG (MainThread) [pymodbus.logging] Processing: {hexed(answered)}\n"
    return log


def arguments() -> str:
    key = "modbus_read_registers[/dev/ttyS1 19200 N 8 1,26,74,4,f,1,0]"
    log = ""
    for asked, answered in ((A, R), (A2, R2)):
        log += f' 29199:20180110:144201.371 active check "{key}" is not supported: Connection timed out\n'
        log += f"[{asked.replace(' ', '][')}]\nWaiting for a confirmation...\n<{answered.replace(' ', '><')}>\n"
    return log


def arguments_of_a_service() -> str:
    return "".join(f"Nov 28 10:00:{at:02d} pi app[311]: {line}\n" for at, line in enumerate(arguments().splitlines()))


LOGS: dict[Callable[[], str], tuple[str, ...]] = {
    forum: (A, R),
    jsmodbus: (A, R),
    pymodbus_echo: (A, R, A2, R2),
    tokio: (R,),
    minimalmodbus: (A, R, A2, CUT, A, R),
    minimalmodbus_errors: (R, R2),
    mbusd: (A, R, A2, CUT, R2),
    names_with_values: (A, R, A2, R2, A2, CUT, "FF"),
    doubled: (A, R, A2, R2),
    arguments: (A, R, A2, R2),
    arguments_of_a_service: (A, R, A2, R2),
}


@pytest.mark.parametrize("log", LOGS, ids=lambda log: log.__name__)
@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["", "CR"])
def test_logs_of_libraries(log: Callable[[], str], end: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text(log().replace("\n", end), newline="")
    capture = read(path)
    chunks = [item for item in capture.items() if isinstance(item, Chunk)]
    assert b"".join(chunk.octets for chunk in chunks).hex(" ").upper() == " ".join(LOGS[log])
    assert all(before.time <= after.time for before, after in pairwise(chunks))
    assert capture.completeness().whole, capture.completeness().text


@pytest.mark.parametrize(
    "line",
    [
        "[17:27:3{0}][W][modbus:121]: Modbus CRC Check failed! C03E!=FE0{0}",
        "[12:57:09.44{0}][W][modbus:148]: CRC error: 8011 != FFF{0}",
        "crc of message {0}: 41FE == 41F{0}",
        "16:23:59 08/17/1{0} CEST",
        "the report of 08/1{0}/17 is here",
    ],
)
def test_what_is_compared_and_dates_are_no_octets(line: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(f"{line.format(number)}\n" for number in range(6)))
    with pytest.raises(CaptureError, match="no byte log"):
        read(path)


def test_requests_of_register_0_are_no_headers_of_a_network(tmp_path: Path) -> None:
    """`01 04 00 00 00 02` could be a transaction, a protocol and a length; the answers are all damaged."""
    path = tmp_path / "x.log"
    asked, answered = "01 04 00 00 00 02 71 CB", "01 04 04 43 6C 3E E8 3E 1D"
    path.write_text("".join(f"10:00:0{at}.100 TX {asked}\n10:00:0{at}.160 RX {answered}\n" for at in range(6)))
    capture = read(path)
    session = detected(capture.session)
    assert session.protocol == "modbus-rtu"
    rows = [item.row for item in settled(capture.items(), session)]
    assert [row.event.octets.hex(" ").upper() for row in rows] == [asked, answered] * 6


def grouped(sign: str) -> str:
    octets = CUT.split()
    return sign.join("".join(octets[at : at + 2]) for at in range(0, len(octets), 2))


@pytest.mark.parametrize("sign", [" | ", " - ", "  ", ", ", "; "])
def test_octets_in_groups_are_all_read_without_a_check(sign: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(f"10:00:0{at}.100 TX: {A}\n10:00:0{at}.140 RX: {grouped(sign)}\n" for at in range(3)))
    chunks = [item.octets.hex(" ").upper() for item in read(path).items() if isinstance(item, Chunk)]
    assert chunks == [A, CUT] * 3


def test_what_eModbus_says_of_itself_was_never_on_the_line(tmp_path: Path) -> None:
    """A timeout is its own code, an answer with it is made up."""
    path = tmp_path / "x.log"
    path.write_text(
        "[V] Data: @3FFB3944/1:\n  | 0000: E0                                                |.               |\n"
        "[V] Response packet: @3FFB3944/3:\n  | 0000: 07 84 E0                                          |...             |\n"
        "[D] Sent packet: @3FFB3944/6:\n  | 0000: 07 04 00 10 00 02                                 |......          |\n"
        "[D] Raw buffer received: @3FFB39A0/2:\n  | 0000: 07 00                                             |..              |\n"
        "[D] Received packet: @3FFB3944/1:\n  | 0000: E2                                                |.               |\n"
    )
    chunks = [item.octets.hex(" ").upper() for item in read(path).items() if isinstance(item, Chunk)]
    assert chunks == [A, "07 00"]


def test_decimal_buffers_beside_others_are_decimal(tmp_path: Path) -> None:
    """modbus-serial prints what it logs twice: with `<Buffer …>`, and as JSON."""
    path, log = tmp_path / "x.log", ""
    for text in (A, R, A2, CUT):
        numbers = ",".join(str(int(pair, 16)) for pair in text.split())
        log += f"  modbus-serial {{ action: 'send serial',\n  modbus-serial   data: <Buffer {low(text)}>,\n"
        log += f'  modbus-serial {{"action":"send serial","data":{{"type":"Buffer","data":[{numbers}]}},"unitid":7}} +15ms\n'
    path.write_text(log)
    chunks = [item.octets.hex(" ").upper() for item in read(path).items() if isinstance(item, Chunk)]
    assert chunks == [A, R, A2, CUT]


def test_a_message_in_other_digits_than_most(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    unpadded = " ".join(f"{int(pair, 16):x}" for pair in R.split())
    asked = "".join(f"[{1021 + 20 * at}ms] Received: {A}\n" for at in range(5))
    path.write_text(f"It says\n{asked}\nand I answer with this:\n[1212ms] {unpadded} \n")
    chunks = [item.octets.hex(" ").upper() for item in read(path).items() if isinstance(item, Chunk)]
    assert chunks == [A] * 5 + [R]


@pytest.mark.parametrize(
    "line",
    [
        "[12:02:42][V][Growatt:107]: Modbus received Byte  {0} (0X2FE{0})",
        "2024-11-28 10:00:0{0},2{0}.5,4{0}",
        "I (9{0}) boot: load:0x3fff0030,len:717{0}",
        "usb 1-1: New USB device found, idVendor=0403, idProduct=600{0}",
        "[19:17:2{0}][C][wifi:408]:   Local MAC: DC:DA:0C:C5:6E:9{0}",
        "eth{0}: MAC address is dc-da-0c-c5-6e-9{0}",
    ],
)
def test_values_and_lengths_are_no_octets(line: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(f"{line.format(number)}\n" for number in range(8)))
    with pytest.raises(CaptureError, match="no byte log"):
        read(path)


def test_two_lines_of_octets_that_are_whole_are_two(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    path.write_text(
        f"The master sends: {A}\nand the slave replies to this:\n{R} (at first)\n{R2} (after a second time)\n"
    )
    chunks = [item.octets.hex(" ").upper() for item in read(path).items() if isinstance(item, Chunk)]
    assert chunks == [A, R, R2]


@pytest.mark.parametrize("between", [" ", ",", ";", "\t"])
def test_station_7_is_not_the_number_of_the_octets_behind_it(between: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("".join(f"10:00:0{at} {text.replace(' ', between)}\n" for at, text in enumerate([A, A2] * 4)))
    octets = b"".join(item.octets for item in read(path).items() if isinstance(item, Chunk))
    assert octets.hex(" ").upper() == " ".join([A, A2] * 4)
