"""Files that do not say by their name what they are: `.txt`, and standard input."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from dissectors.frame import Chunk
from sniff.engine.capture import Capture, CaptureError
from sniff.formats import read
from sniff.formats.bytelog import ByteLog
from sniff.formats.text import TextCapture

OURS = "#!sniff-capture 1\n# line: 19200,8E1\n+0 01 03\n"
BY_HAND = "# a poll\n\n+0 01 03\n"
LOG = "# from the gateway\n(1.5) bus 01 03\n"
PAIRS = "01 03\n"


def octets(capture: Capture) -> bytes:
    return b"".join(item.octets for item in capture.items() if isinstance(item, Chunk))


@pytest.mark.parametrize(
    ("content", "kind"), [(OURS, TextCapture), (BY_HAND, TextCapture), (LOG, ByteLog), (PAIRS, ByteLog)]
)
def test_what_a_text_is(content: str, kind: type, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "site.txt"
    path.write_text(content)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(content.encode())))
    for capture in (read(path), read("-")):
        assert isinstance(capture, kind)
        assert octets(capture) == b"\x01\x03"


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"hello\n", "1: no byte log that this program reads"), (b"PK\3\4 and so on", " a zip archive; unpack it")],
)
def test_what_is_neither_is_refused_by_its_name(
    content: bytes, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "site.txt"
    path.write_bytes(content)
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(content)))
    for name in (path, "-"):
        with pytest.raises(CaptureError) as caught:
            read(name)
        assert str(caught.value).startswith(f"{name}:{said}")


def test_comments_alone_are_an_empty_text_capture(tmp_path: Path) -> None:
    path = tmp_path / "site.txt"
    path.write_text("# nothing yet\n")
    assert octets(read(path)) == b""


@pytest.mark.parametrize(("others", "said"), [(1, "1 line of other text"), (2, "2 lines of other text")])
def test_what_was_passed_over_is_counted_in_words(others: int, said: str, tmp_path: Path) -> None:
    path = tmp_path / "x.log"
    path.write_text("the port was opened\n" * others + "01 03 00 00 00 02 C4 0B\n01 03 04 00 D7 00 00 4B C5\n" * 4)
    capture = read(path)
    list(capture.items())
    assert f"{said} passed over" in capture.completeness().text
