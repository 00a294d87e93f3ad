"""Lines with little room: what gives way, and what never does."""

from __future__ import annotations

from pathlib import Path

from dissectors.frame import Frame
from sniff.analysis.wording import describe, describe_briefly
from sniff.bus.offline import settled
from sniff.devices import noted_devices
from sniff.engine.follow_settings import dissector_for
from sniff.engine.verdict_join import JudgedRow
from sniff.formats import read

DEVICES = Path(__file__).parents[3] / "captures" / "devices"


def lines(name: str, room: int, *, raw: bool) -> list[tuple[str, str]]:
    """Of each good frame the whole line and the brief one."""
    capture = read(DEVICES / f"{name}.cap.txt")
    dissector = dissector_for(capture.session)

    def both(item: JudgedRow) -> tuple[str, str]:
        brief = describe_briefly(dissector, item.row, item.meaning, room, raw=raw)
        return describe(dissector, item.row, item.meaning), brief

    rows = settled(capture.items(), capture.session, noted_devices(capture.session))
    return [both(item) for item in rows if isinstance(item.row.event, Frame) and item.row.event.ok]


def test_what_is_acknowledged_and_not_done_says_so_first() -> None:
    told = [brief for _, brief in lines("n2-overrides-that-stand", 20, raw=False)]
    assert "1 → acknowledged, not executed: override AI 1 = 30 — A" in told
    assert [line for line in told if "acknowledged" in line and "done" not in line and "not executed" not in line] == []


def test_raw_numbers_give_way_to_values() -> None:
    (_, (whole, brief), *_) = lines("sixteen-registers", 60, raw=False)
    assert "16 registers" in whole
    assert "16 registers" not in brief
    assert "Hz" in brief


def test_where_there_is_room_nothing_gives_way() -> None:
    for name in ("sixteen-registers", "acn-common-area", "bacnet-three-objects", "n2-polls"):
        assert all(whole == brief for whole, brief in lines(name, 10_000, raw=True))
