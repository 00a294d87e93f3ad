"""What cannot be right is an error with its column, shows no row and ends with exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest

from sniff.cli import main
from sniff.filter import FilterError, check_filter

CAPTURE = str(Path(__file__).parents[3] / "captures" / "rtu-usual-faults.cap.txt")

WRONG = (
    ("dst = 3", "did you mean ==?"),
    ("slave == 3", "did you mean 'addr'?"),
    ("Station == 3", "did you mean 'addr'?"),
    ("time > 10:02", "did you mean 'frame.time'?"),
    ("latency > 5", "did you mean 'latency_ms'?"),
    ("crc", "did you mean 'damage'?"),
    ("func_code == 3", "did you mean 'modbus.func_code'?"),  # its own before those of others
    ("address == 3", "did you mean 'addr'?"),
    ("dst == foo", "is a station's address, 'foo' is none"),
    ('dst > "abc"', "is a station's address"),
    ("dst == 3ms", "is a station's address"),
    ("ok == no", "they do not compare"),
    ("ok == 2", "ok is 0 or 1"),
    ("ok == maybe", "ok is true or false"),
    ("ok > 0", "it has no order"),
    ("kind == tokn", "did you mean 'token'?"),
    ("kind == 3", "unknown kind '3'"),
    ("kind > token", "have no order"),
    ("verdict == lte", "did you mean 'late'?"),
    ("verdict = late", "did you mean ==?"),
    ('verdict == "no anser"', 'did you mean "no answer"?'),
    ("role in {request, tokn}", "did you mean 'token'?"),
    ("found == splitt", "did you mean 'split'?"),
    ("damage == crc", "expected one of check"),
    ("proto == modbus", "unknown proto 'modbus'"),
    ("modbus.func_cod == 3", "did you mean 'modbus.func_code'?"),
    ("mstp.sr == 2", "did you mean 'mstp.src'?"),
    ("mstp.foo == 1", "unknown name 'mstp.foo'"),
    ("bacapp.instance == 103", "did you mean 'bacapp.instance_number'?"),
    ("tx.foo == 1", "unknown name 'tx.foo'"),
    ("dts == 3", "did you mean 'dst'?"),
    ("foo", "unknown name 'foo'"),
    ('modbus.func_code == "Read Holding Register"', "did you mean"),
    ("modbus.func_code == three", "unknown modbus.func_code 'three'"),
    ('modbus.reference_num == "3"', "write 3 without quotes"),
    ("modbus.reference_num == abc", "is a number, 'abc' is not"),
    ("modbus.regval_uint16 contains 3", "contains asks texts and octets"),
    ("modbus.regval_uint16 matches 3", "matches asks texts and octets"),
    ("latency_ms > 5mss", "is a duration, '5mss' is none"),
    ("latency_ms > fast", "is a duration"),
    ("latency_ms == dst", "they do not compare"),
    ("frame.time > 5", "is a time, '5' is none"),
    ('frame.time >= "25:00"', "is a time"),
    ('frame.time >= "2026-02-30"', "is a time"),
    ("frame.time + frame.time > 5", "two times have no sum"),
    ("addr == a", "is a station's address"),
    ("hex contains 55:f", "compared with octets"),
    ("hex contains 030", "ends in half an octet"),
    ('hex contains "zz"', "compared with hex digits"),
    ("frame.octets == xyz", "compared with octets"),
    ("frame.octets[2:2 == 03", "did you mean [2:2] with its closing ]?"),
    ("frame.octets[a] == 03", "unreadable slice"),
    ("frame.octets[3-1] == 03", "ends before it begins"),
    ("frame.octets[0:0] == 03", "is empty"),
    ("dst[0] == 3", "has no octets"),
    ("dst in 3", "expected { after in"),
    ("dst in {}", "expected a value in the set"),
    ("dst in {1..}", "expected a value"),
    ("dst in {5..1}", "the range ends before it begins"),
    ("dst in {1, 2", "expected } at the end of the set"),
    ("dst == ", "expected a value"),
    ("dst == 3 4", "expected && or ||"),
    ("(dst == 3", "expected )"),
    ("dst == 3 &&", "expected a name"),
    ("&& dst == 3", "expected a name"),
    ("dst == 3 | src == 2", "did you mean ||?"),
    ("dst + 1", "a value alone"),
    ("dst + kind == 3", "takes numbers; kind is a text"),
    ("lenn(kind) > 3", "unknown function 'lenn'"),
    ("len(dst) > 3", "takes a text; dst is a station"),
    ("abs(kind) > 3", "takes a number; kind is a text"),
    ("len(kind, text) > 3", "takes one value"),
    ('kind matches "("', "regular expression"),
    ("3 == 4", "expected a field, not 3"),
    ("finding == XX001", "unknown finding 'XX001'"),
    ("line.error == brake", "did you mean 'break'?"),
    ('kind == "token', 'without its closing "'),
    ("dst == 3 # x", "unexpected '#'"),
    ("len / 0 == 1", "nothing is divided by 0"),
    ("len % 0 == 1", "nothing is divided by 0"),
    ("len(5) == 1", "expected a field, not 5"),
    ("5", "expected a field, not 5"),
    ("max(9, 9) == 9", "expected a field, not 9"),
    ('text contains "\\x"', "takes two hex digits"),
    ('text matches "[[:alpha:]]"', "[:alpha:] is not known here"),
    ("frame.octets[2:2] == 03", "frame.octets[…] has 2 octets, 03 1"),
    ("frame.octets[2:2] == 03:00:01", "has 2 octets"),
    ("frame.octets[-2:2] in {03}", "has 2 octets"),
    ("hex[0-1,3] != 03", "has 3 octets"),
    ('kind[0:2] == "rea"', "has 2 characters"),
    ("frame.octets[0] contains 03:04", "has 1 octets"),
    ("noise_before == 1.5", "noise_before is a whole number"),
    ("dst in {1.5}", "dst is a whole number"),
    ("error == 5", 'write "5" in quotes'),
    ("dst == 300", "dst is 0 … 255, never 300"),
    ("dst > 300", "dst is 0 … 255, never 300"),
    ("dst < 300", "dst is 0 … 255, never 300"),
    ("dst != 300", "dst is 0 … 255, never 300"),
    ("300 == dst", "dst is 0 … 255, never 300"),
    ("dst == -1", "dst is 0 … 255, never -1"),
    ("dst in {1..300}", "dst is 0 … 255, never 300"),
    ("dst not in {3, 300}", "dst is 0 … 255, never 300"),
    ("max(dst, 300) == 3", "dst is 0 … 255, never 300"),
    ("mbrtu.unit_id == 256", "mbrtu.unit_id is 0 … 255"),
    ("register == 70000", "register is 0 … 65535"),
    ("count == 0x10000", "count is 0 … 65535, never 0x10000"),
    ("func == 128", "func is 0 … 127"),
    ("modbus.func_code & 0x80", "modbus.func_code is 0 … 127"),
    ("modbus.regval_uint16 == 70000", "modbus.regval_uint16 is 0 … 65535"),
    ("modbus.regval_uint16 == 1.5", "is a whole number, 1.5 is none"),
    ("modbus.exception_code in {2..256}", "modbus.exception_code is 0 … 255"),
    ("len == -1", "len is 0 or more"),
    ("dst > 255", "dst is 0 … 255, never more than 255"),
    ("0xff < dst", "never more than 0xff"),
    ("no < 1", "no is 1 or more, never less than 1"),
    ("latency_ms < 0", "latency_ms is 0 or more, never less than 0"),
    ("dst + 1 == 300", "dst + 1 is 1 … 256, never 300"),
    ("len - 1 < -1", "never"),
    ("dst % 4 == 4", "dst % 4 is 0 … 3, never 4"),
    ("dst & 3 == 4", "dst & 3 is 0 … 3, never 4"),
    ("(dst + src) * 2 > 1020", "(dst + src) * 2 is 0 … 1020"),
    ('verdict matches "^answred"', "no verdict fits"),
    ('proto == "mstp"', "no frame is 'mstp'; these frames are Modbus RTU"),
    ("mstp", "no frame is BACnet MS/TP; these frames are Modbus RTU"),
    ("bacapp && dst == 3", "bacapp is carried by BACnet MS/TP; these frames are Modbus RTU"),
    ("no == 0", "no is 1 or more"),
    ('mstp.frame_type == "Token"', "mstp.frame_type is a field of BACnet MS/TP; these frames are Modbus RTU"),
    ("dst == 3 && mstp.src == 2", "did you mean src?"),
    ("mbascii.unit_id == 3", "did you mean mbrtu.unit_id?"),
    ("!bacapp.type", "bacapp.type is a field of BACnet MS/TP"),
    ("n2.region in {1..3}", "n2.region is a field of Metasys N2"),
    ("pb.da == 3", "pb.da is a field of PROFIBUS DP"),
    ("kind == token", "'token' is a kind of BACnet MS/TP and PROFIBUS DP; these frames are Modbus RTU"),
    ("kind in {token, poll-for-master}", "'token' is a kind of"),
    ("finding == MS701", "'MS701' is a finding of BACnet MS/TP"),
    ("func == Token", "unknown func 'Token'"),
    ('kind contains "WRITE"', "contains minds capitals"),
    ('kind contains "tokn"', "no kind holds"),
    ('verdict contains "Late"', "'late' does otherwise written"),
    ('lower(error) == "Illegal"', "lower(error) is all in lower case"),
    ('upper(kind) contains "write"', "upper(kind) is all in upper case"),
    ("modbus.response_time > 5ms", "unknown name 'modbus.response_time'"),
    ("dst == 3 Hz", "'3 Hz' is none"),
    ("point == foo", "no station has a profile (-d STATION=PROFILE)"),
    ("value > 30 Hz", "no point has a unit here"),
    ("output-frequency > 30", "unknown name 'output-frequency'"),
    ("point > a", "have no order"),
)

WRONG_OF_DRIVES = (
    ("output-frequency > 30 A", "output-frequency is in Hz, not in 'A'"),
    ("output-frequency > fast", "output-frequency is a number, 'fast' is not"),
    ("output-frequncy > 30", "did you mean 'output-frequency'?"),
    ('point == "output frequncy"', "did you mean"),
    ("value > 30 kg", "not in 'kg'"),
    ("value == runing", "unknown value 'runing'"),
    ("fault == ovrcurrent", "unknown fault 'ovrcurrent'"),
    ("fault > overcurrent", "unknown fault"),
    ("output-frequency in {50..30}", "the range ends before it begins"),
    ("dst == teco-f510", "did you mean 'teco-e510'?"),
)


@pytest.mark.parametrize(("text", "said"), WRONG)
def test_it_says_what_is_wrong(text: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", CAPTURE, "-Y", text]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert said in shown.err
    assert " at column " in shown.err


@pytest.mark.parametrize(("text", "said"), WRONG_OF_DRIVES)
def test_it_says_what_is_wrong_with_points(text: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", CAPTURE, "-d", "1=teco-e510", "-Y", text]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert said in shown.err
    assert " at column " in shown.err


def test_one_of_several_captures_must_have_the_field(capsys: pytest.CaptureFixture[str]) -> None:
    other = CAPTURE.replace("rtu-usual", "n2-usual")
    assert main(["show", other, CAPTURE, "-Y", "modbus.func_code == 8"]) == 0
    shown = capsys.readouterr()
    assert len([line for line in shown.out.splitlines() if line and line not in (other, CAPTURE)]) == 2
    assert "these frames are Metasys N2" in shown.err
    assert main(["show", other, CAPTURE, "-Y", "mstp.src == 8"]) == 2


def test_a_filter_for_several_protocols_is_none_of_one_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", CAPTURE, "-Y", "modbus.func_code == 8 || mstp.frame_type == Token"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2
    for text in ('mstp.frame_type == "Token"', "kind == token", "dst == 200", "func == Token"):
        check_filter(text)
    for text in ("mstp.frame_typ == 0", "dst == 300", "mstp.src == 3 && modbus.func_code == 3"):
        with pytest.raises(FilterError):
            check_filter(text)


@pytest.mark.parametrize("command", ["info", "stats", "check", "points", "diff", "snapshot", "show"])
def test_it_is_wrong_everywhere(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    files = [CAPTURE, CAPTURE] if command == "diff" else [CAPTURE]
    assert main([command, *files, "-Y", "dts == 3"]) == 2
    assert "did you mean 'dst'?" in capsys.readouterr().err


def test_many_are_wrong() -> None:
    assert len(WRONG) >= 60


def test_fields_go_with_their_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", CAPTURE, "-e", "kind"]) == 2
    assert "-T fields" in capsys.readouterr().err
    assert main(["show", CAPTURE, "-T", "fields", "-e", "modbus.func_cod"]) == 2
    assert "did you mean 'modbus.func_code'?" in capsys.readouterr().err
