"""Frames of a second protocol in a file that is opened: named in the header, the list, the tree and on the Line."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from dissectors.frame import Chunk
from dissectors.line import MS, LineSettings
from sniff.bus.file_source import FileFeed
from sniff.engine.session import Session
from sniff.filter import FilterError
from sniff.formats import create_of_items, read
from sniff.tui.app import SnifferApp

ASKED, ANSWERED = bytes.fromhex("010300000002c40b"), bytes.fromhex("01030400060005da31")
TOKENS = bytes.fromhex("55ff000102000040"), bytes.fromhex("55ff000304000004")


def shown(app: SnifferApp) -> str:
    return "\n".join("".join(part.text for part in strip) for strip in app.screen._compositor.render_strips())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A master that polls, and tokens between: in one read two of them, behind an octet that is none."""
    file, at = tmp_path / "two.mcap", 1_772_359_200_000_000_000
    session = Session("/dev/ttyUSB0", LineSettings.parse("19200,8E1"), "modbus-rtu", at)
    with create_of_items(file, session) as writer:
        for number in range(8):
            token = TOKENS[number % 2] if number != 3 else b"\xaa" + b"".join(TOKENS)
            for octets in (ASKED, ANSWERED, token):
                at += 60 * MS
                writer.write(Chunk(at, octets))
    return file


def test_a_second_protocol_is_named_and_read(path: Path) -> None:
    async def main() -> None:
        capture = read(path)
        app = SnifferApp(FileFeed(str(path), capture, capture.session))
        async with app.run_test(size=(120, 40)) as pilot:
            await pilot.press("home", *["down"] * 11)
            for _ in range(100):
                await pilot.pause(0.05)
                if app.viewing.foreign is not None:
                    break
            await pilot.pause(0.1)
            assert (app.status.second, app.status.foreign) == ("mstp", 9)
            list_and_tree = shown(app)
            assert "modbus-rtu+mstp" in list_and_tree
            assert list_and_tree.count("mstp: 2 → 1 token ") == 3
            assert "mstp: 2 → 1 token; 4 → 3 token" in list_and_tree
            assert "frame type: Token" in list_and_tree
            with pytest.raises(FilterError, match="show -Y"):
                app.viewing.set_filter("mstp.frame_type == Token")
            await pilot.press("9")
            await pilot.pause(0.2)
            assert "9 frames of BACnet MS/TP among what is none of Modbus RTU" in shown(app)

    asyncio.run(main())
