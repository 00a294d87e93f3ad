"""A toy protocol and a builder of stores, so that the screens are tested without any real protocol.

A toy frame is: station, function, values …, sum. Requests carry one value (a register), responses as many as they like.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from textual import events
from textual.css import stylesheet
from textual.css.model import RuleSet
from textual.keys import _character_to_key, key_to_character
from textual.screen import Screen

from dissectors.frame import Check, Damage, FoundBy, Frame, Header, LineError, Mark, Noise, Place, Reason, Role
from dissectors.line import LineSettings
from dissectors.manifest import Dissector
from dissectors.tracker import Interval, Placement, Transaction, Verdict
from sniff.bus.feed import FeedStatus, StoreFeed
from sniff.bus.rows import Store
from sniff.engine.engine import Output, Row
from sniff.engine.session import Adapter, Session
from sniff.tui.app import SnifferApp

_parse_css = stylesheet.parse
_parsed_css: dict[tuple[object, ...], list[RuleSet]] = {}


def _parsed_once(scope: str, css: str, read_from: Any, variable_tokens: Any, **more: Any) -> list[RuleSet]:
    """The same style sheets are those of every app: to parse them anew for each took a twelfth of these tests' time."""
    variables = tuple((name, tuple(token.value for token in tokens)) for name, tokens in variable_tokens.items())
    key = (scope, css, read_from, variables, *more.items())
    if key not in _parsed_css:
        _parsed_css[key] = list(_parse_css(scope, css, read_from, variable_tokens=variable_tokens, **more))
    return _parsed_css[key]


stylesheet.parse = _parsed_once  # type: ignore[assignment]

_draw = Screen._compositor_refresh


def _drawn_when_looked_at(screen: Screen) -> None:
    """What stands on a screen between a key and its last consequence nobody sees here, and how often it would be drawn
    meanwhile depends on what else the machine does: `Looking.draw` draws it, for who looks at it."""


Screen._compositor_refresh = _drawn_when_looked_at  # type: ignore[method-assign]

MS = 1_000_000
START = 1_772_359_200_000_000_000  # 2026-03-01T10:00:00Z


def _unused(*_: Any) -> Any:
    raise AssertionError("the UI neither frames nor tracks")


def _peek(frame: Frame) -> Header:
    return Header("toy", None, frame.octets[0], Role.EITHER, "read", frame.octets[1], ok=frame.ok)


def _text(frame: Frame, header: Header, role: Role) -> str:
    arrow = "→" if role is Role.RESPONSE else "←"
    return f"{frame.octets[0]} {arrow} read {frame.octets[2:-1].hex(' ')}"


def _fields(frame: Frame, role: Role) -> dict[str, int | float | str]:
    return {"n2.address": frame.octets[0], "n2.function": frame.octets[1]}


def _packet(frame: Frame, role: Role) -> Any:
    from scapy.fields import BitField, ByteEnumField, ByteField, FCSField, FieldListField, ShortField
    from scapy.packet import Packet

    class Values(Packet):
        name = "values"
        fields_desc = (
            BitField("high", 0, 4),
            BitField("low", 0, 4),
            FieldListField("rest", [], ByteField("value", 0), length_from=lambda packet: 2),
        )

        def extract_padding(self, s: bytes) -> tuple[bytes, bytes]:
            return b"", s

    class Toy(Packet):
        name = "toy frame"
        fields_desc = (
            ByteField("station", 0),
            ByteEnumField("function", 0, {3: "read"}),
            FCSField("sum", None, fmt="B"),
        )

        def guess_payload_class(self, payload: bytes) -> Any:
            return Values

    class Asked(Packet):
        name = "toy request"
        fields_desc = (
            ByteField("station", 0),
            ByteField("function", 0),
            ShortField("register", 0),
            ByteField("sum", 0),
        )

    return Asked(frame.octets) if role is Role.REQUEST else Toy(frame.octets)


TOY = Dissector("toy", "Toy", _unused, _peek, _unused, _text, _fields, _packet)


class Bus:
    """Builds what an engine would have given. Times go on by themselves."""

    def __init__(self, store: Store) -> None:
        self.store = store
        self.now = START
        self.no = store.last_no
        self.tx = 0

    def frame(self, octets: bytes, damage: Damage | None = None, marks: tuple[Mark, ...] = (), **more: Any) -> Frame:
        start = self.now
        self.now += len(octets) * self.store.session.line.char
        check = Check.GOOD if damage is None else Check.BAD
        return Frame("toy", octets, start, self.now, check, FoundBy.GAP, damage, marks=marks, **more)

    def row(self, event: Frame | Noise, tx: int | None = None, role: Role = Role.UNKNOWN) -> Row:
        self.no += 1
        if isinstance(event, Noise):
            return Row(self.no, event)
        station = event.octets[0]
        ends = (None, station) if role is not Role.RESPONSE else (station, None)
        place = None if tx is None else Placement(self.no, tx, role, *ends)
        return Row(self.no, event, _peek(event), place)

    def ask(
        self,
        station: int = 1,
        verdict: Verdict | None = Verdict.ANSWERED,
        latency: float | None = 8.2,
        values: bytes = b"\x12\x34\x56",
        marks: tuple[Mark, ...] = (),
        damage: Damage | None = None,
        **more: Any,
    ) -> Transaction | None:
        """One exchange; without response for verdicts that have none; still open for None. `latency`: ms, None where
        nobody knows it."""
        self.tx += 1
        request = self.row(self.frame(bytes([station, 3, 0, 7, 99])), self.tx, Role.REQUEST)
        rows = [request]
        asked = self.now
        self.now += int((latency or 0) * MS)
        response = None
        if verdict not in (Verdict.NO_RESPONSE, None):
            event = self.frame(bytes([station, 3, *values, 77]), damage, marks)
            response = self.row(event, self.tx, Role.RESPONSE)
            rows.append(response)
        self.now += 20 * MS
        held = self.store.session.adapter.latency
        closed = ()
        if verdict is not None:
            took = None if latency is None or response is None else int(latency * MS)
            span = None if took is None else Interval(took, took, took + held)
            number = response.no if response else None
            closed = (
                Transaction(
                    self.tx, station, "read", request.no, number, verdict, request.event.start, asked, span, **more
                ),
            )
        self.store.add(Output(tuple(rows), closed))
        return closed[0] if closed else None

    def noise(self, octets: bytes = b"\x00\x00", marks: tuple[Mark, ...] = ()) -> None:
        start = self.now
        self.now += len(octets) * self.store.session.line.char
        event = Noise(octets, start, self.now, Place.BETWEEN, Reason.NO_FRAME, marks)
        self.store.add(Output((self.row(event),)))
        self.now += 5 * MS


@pytest.fixture(autouse=True)
def _utc() -> Iterator[None]:
    """Clock times in the lists are local: here that is UTC."""
    before = os.environ.get("TZ")
    os.environ["TZ"] = "UTC"
    time.tzset()
    yield
    if before is None:
        del os.environ["TZ"]
    else:
        os.environ["TZ"] = before
    time.tzset()


@pytest.fixture
def make_bus() -> Callable[..., Bus]:
    """An empty bus: `make_bus(latency=ns held back, keep=rows kept, said=who says so)`."""

    def make(
        latency: int = 16 * MS,
        reports: tuple[str, ...] | None = ("parity", "framing"),
        keep: int = 10**6,
        said: str = "latency timer",
    ) -> Bus:
        adapter = Adapter("FT232R", "ftdi_sio", latency, said, reports)
        session = Session("/dev/ttyUSB0", LineSettings.parse("19200,8E1"), "toy", START, adapter=adapter)
        return Bus(Store(session, TOY, keep))

    return make


@pytest.fixture
def busy_bus(make_bus: Callable[..., Bus]) -> Bus:
    """Rows 1 … 14: good 1-4, noise 5, no answer 6, damaged answer 7-8, exception 9-10, good 11-12, open 13."""
    made = make_bus()
    made.ask(1)
    made.ask(2, latency=38)
    made.noise(b"\x00\xff", (Mark(0, LineError.BREAK),))
    made.ask(3, Verdict.NO_RESPONSE, attempt=2, of=1)
    made.ask(4, Verdict.DAMAGED_ANSWER, marks=(Mark(2, LineError.PARITY | LineError.FRAMING),), damage=Damage.CHECK)
    made.ask(1, Verdict.EXCEPTION, error="illegal data address")
    made.ask(1)
    made.ask(2, None)
    return made


class Looking:
    """A running app in a test: press keys, read the screen as text."""

    def __init__(self, app: SnifferApp, pilot: Any, feed: StoreFeed) -> None:
        self.app = app
        self.pilot = pilot
        self.feed = feed

    async def settle(self) -> None:
        """Wait until nothing is pending: messages, searching, details."""
        for _ in range(300):
            await self.pilot.pause(0.005)
            shown = self.app.shown
            idle = shown is not None and not shown.work_left() and getattr(shown, "_detail_timer", None) is None
            if idle and not self._waits_for_layout():
                break
        await self.pilot.pause(0)

    def draw(self) -> None:
        """Draw what is not drawn yet, as a terminal would get it; who reads the screen has it drawn."""
        _draw(self.app.screen)

    def _waits_for_layout(self) -> bool:
        """Whether a widget has other content whose place on the screen is not worked out yet."""
        screen = self.app.screen
        return screen._layout_required or any(widget._layout_required for widget in screen.walk_children())

    async def press(self, *keys: str) -> None:
        """Press keys one after the other (the pilot's own `press` waits ten times as long)."""
        for key in keys:
            self.app.post_message(events.Key(key, key_to_character(key) if len(key) > 1 else key))
            await self.pilot.pause(0)
            await self.pilot.pause(0)
            await self.settle()  # what a key does must be done before the next one comes

    async def type(self, text: str) -> None:
        """Type text; must not be used for keys that are named."""
        for character in text:
            self.app.post_message(events.Key(_character_to_key(character), character))
        await self.settle()

    async def poll(self) -> None:
        self.app.poll()
        await self.settle()

    @property
    def main(self) -> Any:
        return self.app.shown.query_one("#main")

    @property
    def drawn_lines(self) -> int:
        """How many lines of the screen's list were ever drawn, those that are due now among them."""
        self.draw()
        drawn: int = self.main.drawn_lines
        return drawn

    def lines(self) -> list[str]:
        """The screen as text, a string a line, without spaces at the end."""
        self.draw()
        strips = self.app.screen._compositor.render_strips()
        return ["".join(segment.text for segment in strip).rstrip() for strip in strips]

    def text(self) -> str:
        return "\n".join(self.lines()) + "\n"

    def notices(self) -> list[str]:
        return [notification.message for notification in self.app._notifications]


Script = Callable[[Looking], Awaitable[None]]


@pytest.fixture
def look(monkeypatch: pytest.MonkeyPatch) -> Callable[..., SnifferApp]:
    """`look(store, script, size=…, start=…, **status)` runs the app over a store and the script with it."""
    monkeypatch.setattr("sniff.tui.screens.frames.DETAIL_SECONDS", 0.001)  # nobody holds a key down here
    monkeypatch.setattr("sniff.tui.screens.frames.FOLLOWING_SECONDS", 0.001)
    monkeypatch.setattr("textual.notifications.Notification.has_expired", False)  # however slow the machine is

    def run(
        store: Store, script: Script, size: tuple[int, int] = (80, 24), start: str = "frames", **status: Any
    ) -> Any:
        session = store.session
        known = {"recording": None, "file_size": 12_345, "live": False} | status
        feed = StoreFeed(store, FeedStatus(session.port, str(session.line), session.protocol, **known))
        app = SnifferApp(feed, start)

        async def main() -> None:
            async with app.run_test(size=size) as pilot:
                looking = Looking(app, pilot, feed)
                await looking.settle()
                await script(looking)
                if app.screen_stack:
                    looking.draw()

        asyncio.run(main())
        return app

    return run


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """`golden(name, text)` compares with golden/NAME.txt; writes it when the environment says UPDATE_GOLDEN=1."""

    def compare(name: str, text: str) -> None:
        path = Path(__file__).parent / "golden" / f"{name}.txt"
        if os.environ.get("UPDATE_GOLDEN") == "1":
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, "utf-8")
        assert text == path.read_text("utf-8")

    return compare
