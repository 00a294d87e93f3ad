"""Pictures of the screens from simulated buses: `python -m tests.sniff.tui.screenshots captures/pictures`.

The same program gives the same pictures: seeds, times and zone are fixed. They need no fonts from anywhere.
"""

from __future__ import annotations

import asyncio
import os
import re
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from dissectors.line import NS_PER_S
from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.bus.offline import outputs
from sniff.bus.rows import Store
from sniff.devices import devices
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import observe
from sniff.simulation.scenarios import scenario, simulate
from sniff.simulation.tap import TapModel
from sniff.tui.app import SnifferApp

STARTED = 1_772_359_200 * NS_PER_S  # 2026-03-01T10:00:00Z
SECONDS = {"mstp": 30}
"""Of a scenario, else three minutes; a token ring brings as many frames in less."""
ADAPTER = TapModel("FT232R", timer=1_000_000, packet=62, usb_frame=1_000_000, reports=("parity", "framing", "break"))
CELL = 12.2
"""Width of a character in a picture."""
FONTS = "DejaVu Sans Mono, Menlo, Consolas, monospace"


@dataclass(frozen=True, slots=True)
class Shot:
    """One picture: a scenario, a size in cells, keys to press ("text:" types), and whether it is light."""

    name: str
    scenario: str
    size: tuple[int, int]
    keys: tuple[str, ...]
    light: bool = False


SHOTS = (
    Shot("frames-80x24", "modbus-rtu", (80, 24), ("home", *"eeeee", "enter")),
    Shot(
        "frames-mstp",
        "mstp",
        (140, 40),
        ("home", "d", "colon", "text:17", "enter", "enter", "end", *["up"] * 6),
    ),
    Shot("frames-light", "n2", (110, 32), ("home", "down", "down", "down", "enter", "down", "down"), light=True),
    Shot("filter", "modbus-rtu", (80, 24), ("home", "slash", "text:verdict == no-response && addr == 4")),
    Shot("transactions", "modbus-rtu", (110, 30), ("2", "home", "e", "e")),
    Shot("nodes", "modbus-rtu", (80, 24), ("3",)),
    Shot("points", "modbus-rtu", (100, 30), ("4",)),
    Shot("findings", "modbus-rtu", (100, 30), ("5",)),
    Shot("timeline", "modbus-rtu", (120, 36), ("6",)),
    Shot("ring", "mstp", (100, 30), ("7",)),
    Shot("line", "modbus-rtu", (100, 30), ("9",)),
    Shot("polls", "modbus-rtu", (100, 30), ("8",)),
    Shot("help", "modbus-rtu", (80, 24), ("question_mark",)),
)


@cache
def store_of(name: str) -> Store:
    """What a sniffer with a usual adapter hears of a scenario in some minutes."""
    plan = scenario(name, seed=7)
    session, items = simulate(plan, SECONDS.get(name, 180), ADAPTER, STARTED)
    store = Store(
        session, dissector_for(session), devices=devices({str(at): made for at, made in plan.devices.items()})
    )
    observe(outputs(items, session), store)
    return store


async def take(shot: Shot) -> tuple[str, str]:
    """The picture as SVG, and as text."""
    from textual.events import Key
    from textual.keys import _character_to_key

    store = store_of(shot.scenario)
    session = store.session
    status = FeedStatus(
        "/dev/ttyUSB0",
        str(session.line),
        session.protocol,
        "boiler-room.mcap",
        12_345_678,
        live=True,
        priority="real-time",
    )
    app = SnifferApp(StoreFeed(store, status))
    async with app.run_test(size=shot.size) as pilot:
        if shot.light:
            app.action_theme()
        await pilot.pause(0.3)
        for key in shot.keys:
            if key.startswith("text:"):
                for character in key.removeprefix("text:"):
                    app.post_message(Key(_character_to_key(character), character))
            else:
                await pilot.press(key)
            await pilot.pause(0.2)
        await pilot.pause(0.7)
        strips = app.screen._compositor.render_strips()
        text = "\n".join("".join(segment.text for segment in strip).rstrip() for strip in strips)
        return _plain_fonts(app.export_screenshot(title="sniff485")), text


def _plain_fonts(picture: str) -> str:
    """Without fonts from the network; leading spaces as positions, which every viewer draws alike."""
    picture = re.sub(r"@font-face\s*\{.*?\}", "", picture, flags=re.DOTALL).replace("Fira Code", FONTS)
    return re.sub(r'x="([0-9.]+)" y="([0-9.]+)" textLength="([0-9.]+)"([^>]*>)((?:&#160;)+)', _shift, picture)


def _shift(found: re.Match[str]) -> str:
    spaces = CELL * len(found[5]) / len("&#160;")
    return f'x="{float(found[1]) + spaces:.1f}" y="{found[2]}" textLength="{float(found[3]) - spaces:.1f}"{found[4]}'


def main(folder: str, texts: str = "", write: Callable[[str], object] = sys.stdout.write) -> None:
    """Take all pictures; as text into another folder, where one is named: what README.md shows is from there."""
    os.environ["TZ"] = "UTC"
    if hasattr(time, "tzset"):
        time.tzset()
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    for shot in SHOTS:
        path = target / f"{shot.name}.svg"
        picture, text = asyncio.run(take(shot))
        path.write_text(picture, "utf-8")
        if texts:
            Path(texts, f"{shot.name}.txt").write_text(text + "\n", "utf-8")
        write(f"{path}\n")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: python -m tests.sniff.tui.screenshots FOLDER [FOLDER_OF_TEXTS]")
    main(*sys.argv[1:])
