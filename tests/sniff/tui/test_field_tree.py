"""The field tree by itself: siblings of one name, folds, octets."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest
from textual.app import App, ComposeResult

from sniff.analysis.packet_tree import Field
from sniff.tui.field_tree import FieldTree

TAG = tuple(Field("Tag", "", begin, begin + 2, (Field("number", str(begin), begin, begin + 1),)) for begin in (2, 4, 6))
FIELDS = (
    Field("head", "x", 0, 2),
    Field("tags", "3", 2, 8, TAG),
    Field("frame", "1", None, None, (Field("check", "good"),), folded=True),
)


class Only(App[None]):
    def compose(self) -> ComposeResult:
        yield FieldTree()


@pytest.fixture
def with_tree() -> Callable[[Callable[[FieldTree], None]], None]:
    def run(script: Callable[[FieldTree], None]) -> None:
        async def main() -> None:
            app = Only()
            async with app.run_test(size=(40, 20)):
                script(app.query_one(FieldTree))

        asyncio.run(main())

    return run


def names(tree: FieldTree) -> list[str]:
    return [line.field.name for line in tree._lines]


def test_an_octet_picks_the_right_one_of_equal_siblings(with_tree: Callable[..., None]) -> None:
    def script(tree: FieldTree) -> None:
        tree.show(FIELDS)
        for offset, value in ((2, "2"), (4, "4"), (6, "6")):
            assert tree.pick_octet(offset) == Field("number", value, offset, offset + 1)
            assert tree.picked == Field("number", value, offset, offset + 1)
        assert tree.pick_octet(5) is TAG[1]
        assert tree.pick_octet(99) is None
        assert tree.picked is TAG[1]

    with_tree(script)


def test_folding_one_of_equal_siblings(with_tree: Callable[..., None]) -> None:
    def script(tree: FieldTree) -> None:
        tree.show(FIELDS)
        assert names(tree) == ["head", "tags", "Tag", "number", "Tag", "number", "Tag", "number", "frame"]
        tree.pick_octet(5)
        tree.action_fold()
        assert names(tree) == ["head", "tags", "Tag", "number", "Tag", "Tag", "number", "frame"]
        tree.show(FIELDS)  # the next frame, folded alike
        assert names(tree) == ["head", "tags", "Tag", "number", "Tag", "Tag", "number", "frame"]
        assert tree.picked is TAG[1]
        tree.pick_octet(4)  # unfolds what it needs
        assert len(tree._lines) == 9

    with_tree(script)


def test_parent_and_ends(with_tree: Callable[..., None]) -> None:
    def script(tree: FieldTree) -> None:
        tree.show(FIELDS)
        tree.pick_octet(6)
        tree.action_parent()
        assert tree.picked is TAG[2]
        tree.action_parent()
        assert tree.picked is FIELDS[1]
        tree.action_parent()
        assert tree.picked is FIELDS[1]
        tree.action_move(-999)
        assert tree.picked is FIELDS[0]
        tree.action_move(999)
        assert tree.picked is FIELDS[2]
        tree.show(())
        assert tree.picked is None
        tree.action_move(1)
        tree.action_fold()
        tree.action_parent()

    with_tree(script)


def test_what_is_cut_says_so_and_can_be_scrolled_to(with_tree: Callable[..., None]) -> None:
    def script(tree: FieldTree) -> None:
        tree.show((Field("start", "2026-03-01 10:00:05.381854 +0000", None, None), Field("name", "x" * 30, None, None)))
        assert [tree.render_line(y).text.rstrip()[-6:] for y in (0, 1)] == ["4 +00…", "xxxxxx"]
        tree.action_right()
        assert tree.render_line(0).text.rstrip().endswith(" +0000")

    with_tree(script)


def test_what_begins_folded_unfolds_for_an_octet(with_tree: Callable[..., None]) -> None:
    status = Field("status", "running", 0, 2, (Field("bit 0", "1", 1, 2),), folded=True)

    def script(tree: FieldTree) -> None:
        tree.show((status,))
        assert names(tree) == ["status"]
        tree.pick_octet(1)
        assert names(tree) == ["status", "bit 0"]
        tree.action_parent()
        tree.action_fold()
        tree.show((status,))
        assert names(tree) == ["status"]

    with_tree(script)


def test_where_there_is_little_room_the_value_stays(with_tree: Callable[..., None]) -> None:
    long = Field("Register 2524h (wire 0x2524) output frequency", "30.00 Hz", brief="output frequency")

    def script(tree: FieldTree) -> None:
        tree.show((long,))
        assert tree.render_line(0).text.strip() == "output frequency: 30.00 Hz"
        tree.action_right()
        assert "(wire 0x2524)" in tree.render_line(0).text

    with_tree(script)
