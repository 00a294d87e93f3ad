"""Pictures of every screen for every protocol's demo, to be looked at: `make pictures`, or
`python -m tests.sniff.tui.all_screens FOLDER [WORD …]` for those whose names hold all of the words.

Each protocol's scenario is saved as a capture, and opened from there as a user opens it. A picture is a PNG (text is
drawn cell by cell, so no browser is needed) and the same as text, which `grep` and `diff` read.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
from functools import cache
from pathlib import Path
from typing import Any

from matplotlib import get_data_path
from PIL import Image, ImageDraw, ImageFont
from rich.cells import cell_len
from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from rich.terminal_theme import DEFAULT_TERMINAL_THEME, TerminalTheme

from sniff.bus.capture_writer import create
from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.devices import devices
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.formats import read
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import TapModel
from sniff.tui.app import SnifferApp
from sniff.tui.screens import SCREENS

STARTED = 1_772_359_200_000_000_000  # 2026-03-01T10:00:00Z
SECONDS = {"mstp": 30, "profibus": 15}
"""How long a demo runs: they bring as many frames then as the others do in five minutes."""
ADAPTER = TapModel("FT232R", timer=1_000_000, packet=62, usb_frame=1_000_000, reports=("parity", "framing", "break"))
PROTOCOLS = ("modbus-rtu", "modbus-ascii", "n2", "mstp", "profibus")
SIZES = ((80, 24), (120, 40), (200, 60))
CELL = (8, 16)


@cache
def capture_of(name: str, folder: Path) -> Path:
    """The scenario of that name as a capture in a folder, made where it is not there yet."""
    path = folder / f"{name}.mcap"
    if not path.exists():
        plan = scenario(name, seed=485)
        session, items = simulate(plan, SECONDS.get(name, 300), ADAPTER, STARTED)
        with create(path, session) as writer:
            for item in items:
                writer.write(item)
    return path


@cache
def _font(bold: bool, wide: bool = False) -> Any:
    name = "DejaVuSans" if wide else "DejaVuSansMono-Bold" if bold else "DejaVuSansMono"
    return ImageFont.truetype(str(Path(get_data_path()) / "fonts" / "ttf" / f"{name}.ttf"), 13)


def picture(lines: list[list[Segment]], theme: TerminalTheme = DEFAULT_TERMINAL_THEME) -> Image.Image:
    """A screen as an image, a cell at a time."""
    width = max(sum(cell_len(segment.text) for segment in line) for line in lines)
    image = Image.new("RGB", (width * CELL[0], len(lines) * CELL[1]), "black")
    draw = ImageDraw.Draw(image)
    for y, line in enumerate(lines):
        x = 0
        for segment in line:
            style = segment.style or Style.null()
            front, back = _colours(style, theme)
            cells = cell_len(segment.text)
            draw.rectangle((x * CELL[0], y * CELL[1], (x + cells) * CELL[0], (y + 1) * CELL[1]), fill=back)
            for character in segment.text:
                braille = "⠀" <= character <= "⣿"
                draw.text((x * CELL[0], y * CELL[1]), character, fill=front, font=_font(bool(style.bold), braille))
                if style.underline:
                    draw.line((x * CELL[0], y * CELL[1] + 15, (x + 1) * CELL[0], y * CELL[1] + 15), fill=front)
                x += cell_len(character)
    return image


def _colours(style: Style, theme: TerminalTheme) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    front = tuple((style.color or Color.default()).get_truecolor(theme, foreground=True))
    back = tuple((style.bgcolor or Color.default()).get_truecolor(theme, foreground=False))
    if style.reverse:
        front, back = back, front
    if style.dim:
        front = tuple((a * 3 + b * 2) // 5 for a, b in zip(front, back, strict=True))
    return front, back  # type: ignore[return-value]


@cache
def store_of(path: Path) -> Store:
    """What is in a capture, read once for all its pictures."""
    capture = read(path)
    known = devices({str(at): made for at, made in scenario(path.stem).devices.items()})
    store = Store(capture.session, dissector_for(capture.session), devices=known)
    observe(outputs(capture.items(), capture.session), store)
    return store


async def take(path: Path, size: tuple[int, int], light: bool, target: Path, words: tuple[str, ...]) -> None:
    """All screens of one capture in one size."""
    store = store_of(path)
    session = store.session
    status = FeedStatus(path.name, str(session.line), session.protocol, file_size=path.stat().st_size)
    app = SnifferApp(StoreFeed(store, status))
    async with app.run_test(size=size) as pilot:
        if light:
            app.action_theme()
        for entry in SCREENS:
            name = f"{path.stem}-{entry.key}-{entry.name}-{size[0]}x{size[1]}-{'light' if light else 'dark'}"
            if not all(word in name for word in words):
                continue
            await pilot.press(entry.key)
            await pilot.pause(0.1)
            if entry.name in ("frames", "transactions"):
                await pilot.press("home", "e", "e", "e")
            app.poll()
            app.draw_screen()
            await pilot.pause(0.3)
            strips = app.screen._compositor.render_strips()
            lines = [list(strip) for strip in strips]
            picture(lines).save(target / f"{name}.png")
            text = "\n".join("".join(segment.text for segment in line).rstrip() for line in lines)
            (target / f"{name}.txt").write_text(text + "\n", "utf-8")


def main(folder: str, words: tuple[str, ...]) -> None:
    """Take them all."""
    os.environ["TZ"] = "UTC"
    time.tzset()
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    wanted = [name for name in PROTOCOLS if not set(words) & set(PROTOCOLS) or name in words]
    others = tuple(word for word in words if word not in PROTOCOLS)
    for name in wanted:
        for size in SIZES:
            for light in (False, True):
                end = f"{size[0]}x{size[1]}-{'light' if light else 'dark'}"
                sizes = [word for word in words if word in ("dark", "light") or ("x" in word and word[0].isdigit())]
                if all(word in end for word in sizes):
                    asyncio.run(take(capture_of(name, target), size, light, target, others))


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: python -m tests.sniff.tui.all_screens FOLDER [WORD …]")
    main(sys.argv[1], tuple(sys.argv[2:]))
