"""The tree of the selected frame's fields."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.widgets import Tree
from textual.widgets.tree import TreeNode

from sniff.tui.spans import Field

CLOSED = frozenset({"frame", "transaction", "noise"})
"""What is known besides the packet begins folded: its first line says the most."""


class FieldTree(Tree[Field], inherit_bindings=False):
    """Moving in it picks a field; keeps its place when the next frame has the same field."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up,k", "cursor_up", "line up", show=False),
        Binding("down,j", "cursor_down", "line down", show=False),
        Binding("pageup", "page_up", "page up", show=False),
        Binding("pagedown", "page_down", "page down", show=False),
        Binding("home,g", "scroll_home", "first line", show=False),
        Binding("end,G", "scroll_end", "last line", show=False),
        Binding("enter", "toggle_node", "fold", tooltip="fold or unfold the part under the cursor"),
        Binding("left", "cursor_parent", "parent", tooltip="to the part that holds this one", show=False),
    ]

    class Picked(Message):
        """The user moved to a field."""

        def __init__(self, field: Field) -> None:
            super().__init__()
            self.field = field

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__("", id=id)
        self.show_root = False
        self.guide_depth = 2
        self.auto_expand = False
        self._path: tuple[str, ...] = ()

    def show(self, fields: tuple[Field, ...]) -> Field | None:
        """Show the fields of another frame; gives the field that the cursor kept, None when it is not there."""
        path = self._path
        self.clear()
        for field in fields:
            self._add(self.root, field)
        self.root.expand()
        _ = self.last_line  # builds the lines: before, no node knows its own
        kept = self._find(path)
        here = kept or (self.root.children[0] if self.root.children else None)
        if here is not None:
            with self.prevent(Tree.NodeHighlighted):
                self.move_cursor(here)
            self.scroll_to_node(here, animate=False)
        self._path = path  # also when this frame has no such field: the next may have it
        return None if kept is None else kept.data

    def _add(self, parent: TreeNode[Field], field: Field) -> None:
        if field.children:
            node = parent.add(_label(field), field, expand=field.name not in CLOSED)
            for child in field.children:
                self._add(node, child)
        else:
            parent.add_leaf(_label(field), field)

    def _find(self, path: tuple[str, ...]) -> TreeNode[Field] | None:
        node: TreeNode[Field] = self.root
        for name in path:
            found = next((child for child in node.children if child.data is not None and child.data.name == name), None)
            if found is None:
                return None
            node = found
        return None if node is self.root else node

    def pick_octet(self, offset: int) -> Field | None:
        """Move to the smallest field that holds an octet, unfolding what holds it; None when no field does."""
        best: TreeNode[Field] | None = None
        waiting = list(self.root.children)
        while waiting:
            node = waiting.pop()
            if node.data is not None and offset in node.data and (best is None or _size(node) <= _size(best)):
                best = node
            waiting.extend(node.children)
        if best is None:
            return None
        parent = best.parent
        while parent is not None:
            parent.expand()
            parent = parent.parent
        _ = self.last_line  # as above, after unfolding
        with self.prevent(Tree.NodeHighlighted):
            self.move_cursor(best)
        self._path = _path(best)
        self.scroll_to_node(best, animate=False)
        return best.data

    def on_tree_node_highlighted(self, event: Tree.NodeHighlighted[Field]) -> None:
        """Tell which field the cursor is on."""
        event.stop()
        if event.node.data is not None and self.has_focus:
            self._path = _path(event.node)
            self.post_message(self.Picked(event.node.data))


def _size(node: TreeNode[Field]) -> int:
    field = node.data
    return 0 if field is None or field.begin is None or field.end is None else field.end - field.begin


def _path(node: TreeNode[Field]) -> tuple[str, ...]:
    names: list[str] = []
    while node.parent is not None and node.data is not None:
        names.append(node.data.name)
        node = node.parent
    return tuple(reversed(names))


def _label(field: Field) -> Text:
    return Text.assemble((field.name, "bold"), f": {field.value}" if field.value else "")
