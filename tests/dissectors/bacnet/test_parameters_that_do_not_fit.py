"""Messages whose parameters are not those of their service, and what is no value of its property (MS703, MS704)."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.content import Odd, oddities
from dissectors.bacnet.envelope import npdu_frame
from dissectors.frame import Check, FoundBy, Frame, Role

_ERROR = "read-property error"
_VALUE = "3007 0c 0c00800004 1955 3e {} 3f"  # of analog-value,4


def _frame(apdu: str) -> Frame:
    return Frame("mstp", npdu_frame(3, 9, bytes.fromhex("0100" + apdu), False), 0, 0, Check.GOOD, FoundBy.LENGTH)


def _line(frame: Frame) -> str:
    return MSTP.text(frame, MSTP.peek(frame), Role.RESPONSE)


@pytest.mark.parametrize(
    ("apdu", "words"),
    [
        (
            "5007 0c 0e 9102 9120 0f",
            "read-property error: class and code stand between tags 0 that do not belong there",
        ),
        ("5007 0c 2102 9120", "read-property error: error-class is missing, Unsigned stands there"),
        ("5007 0c 0902 1920", "read-property error: error-class is missing, tag [0] stands there"),
        ("5007 0c", "read-property error: error-class is missing"),
        ("3007 0c 0c00800004 1955", "read-property answer: property-value is missing"),
        ("3007 0c 0c00800004 1955 3e 4441", "read-property answer: a tag of 4 octets, 1 left"),
        ("1000 c40200004d 22", "i-am: a tag of 2 octets, 0 left"),
        ("1000 c40200004d 2201e0", "i-am: segmentation-supported is missing"),
        ("1008 0905 1909 2907", "who-is: 1 tag more than the service has"),
    ],
)
def test_what_does_not_fit_is_said(apdu: str, words: str) -> None:
    (found,) = oddities(_frame(apdu))
    assert (found.kind, found.words) == (Odd.FORM, words)


@pytest.mark.parametrize("class_and_code", ["9102 9120", "0e 9102 9120 0f", "2102 9120", "0902 1920"])
def test_class_and_code_are_read_all_the_same(class_and_code: str) -> None:
    assert "error property unknown-property" in _line(_frame("5007 0c " + class_and_code))


@pytest.mark.parametrize(("value", "found"), [("", "empty"), ("0c41b80000", "in a context tag 0"), ("11", "Boolean")])
def test_what_is_no_value_of_its_property(value: str, found: str) -> None:
    frame = _frame(_VALUE.format(value))
    (odd,) = oddities(frame)
    assert (odd.kind, odd.words) == (Odd.TYPE, f"analog-value,4 present-value is {found}, not Real")
    assert f"({found}, not Real)" in _line(frame)


@pytest.mark.parametrize("apdu", ["5007 0c 9102 9120", _VALUE.format("4441b80000"), _VALUE.format("00"), "1008"])
def test_what_fits(apdu: str) -> None:
    assert not oddities(_frame(apdu))


_TEXT = "3007 0c 0c00800004 191c 3e 75{:02x} {} 3f"  # the description of analog-value,4


def _described(octets: str) -> Frame:
    return _frame(_TEXT.format(len(bytes.fromhex(octets)), octets))


@pytest.mark.parametrize(
    ("octets", "shown"),
    [
        ("00 5ac3bc7269", "Züri"),
        ("05 5afc7269", "Züri"),
        ("04 005a00fc", "Zü"),
        ("04 feff005a00fc", "Zü"),
        ("04 fffe5a00fc00", "Zü"),
        ("03 0000feff0000005a", "Z"),
        ("00 5a", "Z"),
    ],
)
def test_texts_of_all_sets(octets: str, shown: str) -> None:
    frame = _described(octets)
    assert not oddities(frame)
    assert f'= "{shown}"' in _line(frame)


@pytest.mark.parametrize(("octets", "shown"), [("00 5afc7269", r"Z\xfcri"), ("00 d6d0", r"\xd6\xd0")])
def test_a_text_that_is_not_what_it_says_keeps_its_octets(octets: str, shown: str) -> None:
    frame = _described(octets)
    (odd,) = oddities(frame)
    assert (odd.kind, odd.words) == (Odd.FORM, f'text "{shown}" is no UTF-8, as it says')
    assert f'= "{shown}"' in _line(frame)
