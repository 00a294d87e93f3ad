"""How tools write octets into a line of text. Pure.

A new spelling is a line of SPELLINGS: what an octet looks like, what may stand between two, how it becomes a number.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

SURELY = 4
"""Octets in a run that are no number of the line, no time and no length."""

_SEPARATOR = r"(?:[ ]?[,;][ ]?|[:._-]|[ \t]{1,2})"
CONTROLS = [
    "NUL",
    "SOH",
    "STX",
    "ETX",
    "EOT",
    "ENQ",
    "ACK",
    "BEL",
    "BS",
    "HT",
    "LF",
    "VT",
    "FF",
    "CR",
    "SO",
    "SI",
    "DLE",
    "DC1",
    "DC2",
    "DC3",
    "DC4",
    "NAK",
    "SYN",
    "ETB",
    "CAN",
    "EM",
    "SUB",
    "ESC",
    "FS",
    "GS",
    "RS",
    "US",
]
_NAMED = {name: code for code, name in enumerate(CONTROLS)} | {
    "TAB": 9, "SP": 0x20, "SPACE": 0x20, "DEL": 0x7F, "NULL": 0
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Spelling:
    """One way to write octets. `token`: an octet; `between`: what may stand between two, None where the token is all of
    them; `least`: how many there must be before it is believed; `decode`: the matched text → octets, ValueError when it
    is none after all.
    """

    name: str
    token: str
    between: str | None
    decode: Callable[[str], bytes]
    least: int = 2
    before: str = r"(?<![0-9A-Za-z_#.])"
    after: str = r"(?![0-9A-Za-z_])"

    def pattern(self) -> re.Pattern[str]:
        """A run of such octets in a line."""
        return self._run(f"{self.least - 1},")

    def short_pattern(self) -> re.Pattern[str]:
        """A run of fewer than would be believed."""
        return self._run(f"0,{max(0, self.least - 2)}")

    def _run(self, more: str) -> re.Pattern[str]:
        run = self.token if self.between is None else rf"{self.token}(?:{self.between}{self.token}){{{more}}}"
        return re.compile(f"{self.before}(?:{run}){self.after}")


def _by(pattern: str, base: int) -> Callable[[str], bytes]:
    compiled = re.compile(pattern)
    return lambda text: bytes(int(found, base) for found in compiled.findall(text))


_ESCAPE = re.compile(r"\\(?:x([0-9A-Fa-f]{2})|u00([0-9A-Fa-f]{2})|([0-7]{1,3})|(.))|(.)", re.DOTALL)
_ESCAPED = {"a": 7, "b": 8, "t": 9, "n": 10, "v": 11, "f": 12, "r": 13, "e": 27}


def _escaped(text: str) -> bytes:
    """A string with escapes, as Python, C, Go and strace write it; only characters of one octet."""
    is_string = text[-1] in "'\""
    inner = text[text.index(text[-1]) + 1 : -1] if is_string else text
    found = bytearray()
    for digits, code, octal, sign, character in _ESCAPE.findall(inner):
        if digits or code:
            found.append(int(digits or code, 16))
        elif octal:
            found.append(int(octal, 8))  # ValueError beyond 377
        elif sign:
            found += bytes((_ESCAPED[sign],)) if sign in _ESCAPED else sign.encode("latin-1")
        else:
            found += character.encode("latin-1")  # UnicodeEncodeError is a ValueError
    octets = bytes(found)
    if octets.startswith(b"\x7fELF"):
        raise ValueError("a program that was read")
    if is_string and text[0] in "'\"" and _LINE_OF_TEXT.fullmatch(inner):
        raise ValueError("a line of text, and how it ends")
    return octets


_LINE_OF_TEXT = re.compile(r"[^\\]*[0-9A-Fa-f]{2}[ :,-][0-9A-Fa-f]{2}[ :,-][0-9A-Fa-f]{2}[^\\]*(?:\\[rnt])+")


def _escapes_alone(text: str) -> bytes:
    """Escapes, and what stands between them for people."""
    return _escaped(re.sub(r"(?<=[0-9A-Fa-fabtnvfr\\])[ ,](?=\\)", "", text))


CHARACTERS = "frames as characters"
NUMBERED = "characters with their numbers"
ENDS = r"(?:<CR>|<LF>|\\r|\\n)*"
_END = re.compile(r"(?:<CR>|<LF>|\\r|\\n|\r|\n)+$")


def _frame_of_characters(text: str) -> bytes:
    """A frame written as its characters, with or without names for its end; its sum must fit."""
    body = _END.sub("", text)
    sums = bytes.fromhex(body[1:]) if body[0] == ":" else b""
    if body[0] == ":" and sum(sums) % 256 == 0:
        return ended(text)
    if body[0] == ">" and sum(body[1:-2].encode()) % 256 == int(body[-2:], 16):
        return ended(text)
    raise ValueError("no frame")


def ended(text: str) -> bytes:
    """A frame written as its characters, with what ends it."""
    body = _END.sub("", text)
    return body.encode() + (b"\r\n" if body[0] == ":" else b"\r")


def _strings(text: str) -> bytes:
    """Strings of a character each, as a list of them is printed."""
    if "\\" not in text:
        raise ValueError("letters")
    return b"".join(_escaped(one) for one in re.findall(_STRING_OF_ONE, text))


def _signed(text: str) -> bytes:
    """Numbers of −128 to 127, as Java has octets; up to 255 where others have them."""
    numbers = [int(number) for number in re.findall(r"-?\d+", text)]
    if not all(-128 <= number <= 255 for number in numbers):
        raise ValueError("no octets")
    return bytes(number & 0xFF for number in numbers)


def _explained(text: str) -> bytes:
    """Octets in hexadecimal, each with its number in decimal or binary, or its character, beside it."""
    found = bytearray()
    for digits, number in re.findall(
        r"(?:0[xX])?([0-9A-Fa-f]{1,2})[hH]? ?(?:[(\[/]((?:0b)?[0-9]+)[)\]]?|\(?'.'\)?)", text
    ):
        octet = int(digits, 16)
        bits = number.removeprefix("0b")
        said = [int(bits, 2)] if len(bits) == 8 and not bits.strip("01") else [int(bits)] if number else [octet]
        if octet not in said:
            raise ValueError("two numbers")
        found.append(octet)
    return bytes(found)


def _codes(text: str) -> bytes:
    """Numbers of characters, as Pascal writes them: `#1#3#123`; two digits in each are hexadecimal."""
    tokens = text.split("#")[1:]
    if all(len(token) == 2 for token in tokens):
        raise ValueError("pairs")
    return bytes(int(token) for token in tokens)


def numbered_characters(text: str) -> bytes:
    """Characters or their names, each with its number behind it: `<SOH> (001) k (107)`, or `k (6b)`."""
    found = bytearray()
    for name, character, number in re.findall(r"(?:<([A-Z0-9]{2,5})>|(\S)) \(([0-9a-f]{2,3})\)", text):
        octet = int(number, 10 if len(number) == 3 else 16)
        if (name and name not in _NAMED) or (character and octet < 0x7F and octet != ord(character)):
            raise ValueError("two numbers")
        found.append(octet)
    return bytes(found)


def _controls(text: str) -> bytes:
    """Characters, and names in angle brackets for those that are none: `<SOH><ETX>A`."""
    found = bytearray()
    for name, character in re.findall(r"<([A-Z0-9]{2,4})>|(.)", text):
        if name and name not in _NAMED:
            if not re.fullmatch(r"[0-9A-F]{2}", name):
                raise ValueError(name)
            found.append(int(name, 16))
        elif name:
            found.append(_NAMED[name])
        else:
            found += character.encode("latin-1")  # UnicodeEncodeError is a ValueError
    return bytes(found)


H2 = r"[0-9A-Fa-f]{2}"
_BESIDE = r"(?:\((?:0b)?[0-9]{1,8}\)|\[(?:0b)?[0-9]{1,8}\]|/[0-9]{1,3}|\('.'\)|'.')"
_ESCAPES = rf"(?:\\x{H2}|\\[abtnvfr0\\])"
SHOWN = r"<[A-Z0-9]{2,5}>|\S"
_CONTROL = rf"<(?:{'|'.join(_NAMED)})>"
_HEX = _by(H2, 16)

_STRING_OF_ONE = rf"b?(?:'(?:\\x{H2}|\\.|[^\\'])'|\"(?:\\x{H2}|\\.|[^\\\"])\")"

ESCAPED_STRING = r"(?P<q>['\"])(?=(?:(?!(?P=q))[^\\]|\\[\\'\"]){0,400}\\[x0-7abtnvfr])"
"""How a string in quotes begins that has escapes in it."""

SPELLINGS: tuple[Spelling, ...] = (
    Spelling(CHARACTERS, rf"(?::(?:[0-9A-F]{{2}}){{3,260}}|>[0-9A-F]{{4,260}}){ENDS}", None,
             _frame_of_characters, 1, before=r"(?<![0-9A-Za-z_#.>])"),
    Spelling("strings of a character", _STRING_OF_ONE, ", ?", _strings, 2, before=r"(?<![0-9A-Za-z_])", after=""),
    Spelling("pairs in quotes", rf"(?:'{H2}'|\"{H2}\")", ", ?", _HEX, SURELY, before="", after=""),
    Spelling("byte strings", rf"(?:b|bytearray\(b)?{ESCAPED_STRING}(?:(?!(?P=q))[^\\]|\\.)*(?P=q)", None, _escaped, 1,
             before=r"(?<![0-9A-Za-z_])", after=""),
    Spelling("escapes", _ESCAPES, r"[ ,]?", _escapes_alone, 2, before=""),
    Spelling(NUMBERED, rf"(?:{SHOWN}) \((?:\d{{3}}|[0-9a-f]{{2}})\)", " ",
             numbered_characters, 2, before=r"(?:(?<=\s)|^)", after=""),
    Spelling("pairs in brackets", rf"(?:\[{H2}\]|<{H2}>|\({H2}\)|\{{{H2}\}})", r"[ ,]?", _HEX, 2, before="",
             after=""),
    Spelling("names of controls", rf"[!-;=?-~]*{_CONTROL}", r"", _controls, 2, after="[!-;=?-~]*",
             before=r"(?:(?<=\s)|^)"),
    Spelling("bits", r"[01]{8}", r"[ ,;]{1,2}", _by(r"[01]{8}", 2), 3),
    Spelling("signed numbers", r"[\[{(](?=[^\]})]{0,4000}-\d)-?\d{1,3}(?:, ?-?\d{1,3}){1,4096}[\]})]", None,
             _signed, 1, before="", after=""),
    Spelling("octets, each with the same beside it", rf"(?:0[xX][0-9A-Fa-f]{{1,2}}|{H2}[hH]?) ?{_BESIDE}", _SEPARATOR,
             _explained, 2, after=""),
    Spelling("binary", r"0b[01]{8}(?: ?\(0[xX][0-9A-Fa-f]{1,2}\))?", _SEPARATOR, _by(r"0b([01]{8})", 2), 1),
    Spelling("0x and digits", r"0[xX][0-9A-Fa-f]{1,2}(?![0-9A-Za-z])", r"['\"]?[ ]?[,;:/|]?[ \t]{0,2}['\"]?",
             _by(r"0[xX]([0-9A-Fa-f]{1,2})", 16), 2),
    Spelling("0x and pairs, joined", rf"(?:0[xX]{H2}){{3,}}", None, _by(r"0[xX]([0-9A-Fa-f]{2})", 16), 1),
    Spelling("pairs joined by _", H2, "_", _HEX, 3),
    Spelling("decimals in brackets", r"(?:[^\s()\[\]]{0,4}|[()\[\]])\(\d{3}\)", r"[ \t]{0,2}",
             _by(r"\((\d{3})\)", 10), 2, before=r"(?:(?<=\s)|^)", after=""),
    Spelling("three decimals in brackets", r"\[\d{3}\]", r"[ ,]?", _by(r"\[(\d{3})\]", 10), 3, before="", after=""),
    Spelling("digits behind 16#", r"(?:[BW]#)?16#[0-9A-Fa-f]{1,2}", r"[ ]?[,;]?[ ]?",
             _by(r"16#([0-9A-Fa-f]{1,2})", 16), 2),
    Spelling("digits and h", rf"0?{H2}[hH]", _SEPARATOR, _by(rf"({H2})[hH]", 16), 2),
    Spelling("character codes", r"#\d{1,3}", "", _codes, SURELY, before=r"(?<![0-9A-Za-z_])"),
    Spelling("digits after a sign", rf"(?:&H[0-9A-Fa-f]{{1,2}}|[$%&#]{H2})", r"[ ,;]{0,2}",
             _by(r"[H$%&#]([0-9A-Fa-f]{1,2})", 16), 2, before=r"(?<![0-9A-Za-z_])"),
    Spelling("H and digits", rf"(?:H{H2}|h[0-9A-F]{{2}})", r"[ ,;]{1,2}", _by(rf"[Hh]({H2})", 16), 3),
)  # fmt: skip
"""Those whose digits need no guess, the most special first."""
