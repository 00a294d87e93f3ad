"""Answers that are longer than the client takes (MS705)."""

from __future__ import annotations

import pytest

from dissectors.bacnet import MSTP
from dissectors.bacnet.long_answers import LongAnswers
from dissectors.frame import Frame
from tests.dissectors.bacnet.ring_script import Step, data, script, token


def _ask(code: int, invoke_id: int = 1, flags: int = 0) -> Step:
    return (2, data(3, 9, f"01040{flags}{code:02x}{invoke_id:02x}0c0c020004d2194c", expects=True))


def _answer(octets: int, invoke_id: int = 1, source: int = 9) -> Step:
    """Of that many octets, without the network header."""
    text = octets - 16  # its own head and tags of 11, those around the octet string of 5
    return (6, data(source, 3, f"010030{invoke_id:02x}0c0c020004d2194c3e65fe{text:04x}{'5a' * text}3f"))


def _said(*steps: Step) -> list[str]:
    lengths = LongAnswers()
    for no, event in enumerate(script(steps).events):
        lengths.see(no, event, MSTP.peek(event) if isinstance(event, Frame) else None)
    return [one.seen for one in lengths.findings()]


@pytest.mark.parametrize(("code", "takes"), [(1, 128), (2, 206), (3, 480), (4, 1024)])
def test_who_sends_one_octet_more_than_the_client_takes(code: int, takes: int) -> None:
    assert not _said(_ask(code), _answer(takes))
    (said,) = _said(_ask(code), _answer(takes + 1))
    assert (
        said == f"sent once an answer that is too long, first one of {takes + 1} octets to MAC 3, which takes {takes}"
    )


@pytest.mark.parametrize(
    "steps",
    [
        (_ask(15), _answer(400)),  # a code that nobody has defined
        (_ask(2), _answer(400, invoke_id=2)),
        (_ask(2), (2, token(3, 9)), _answer(400)),
        (_ask(2), _answer(400, source=8)),
    ],
)
def test_what_is_not_surely_too_long(steps: tuple[Step, ...]) -> None:
    assert not _said(*steps)
