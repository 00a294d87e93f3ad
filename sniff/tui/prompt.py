"""The line that asks for something (a filter, a place to go to) and says while one types whether it can be read."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.message import Message
from textual.suggester import Suggester
from textual.widgets import Input, Label

from sniff.tui.plain import plain

Check = Callable[[str], str]
"""Gives what is wrong with a text, an empty string when nothing is."""

_LAST_WORD = re.compile(r"[A-Za-z_][\w.]*$")


class WordSuggester(Suggester):
    """Completes the last word of what was typed from a list of names (tab or → takes it)."""

    def __init__(self, words: Sequence[str]) -> None:
        super().__init__(use_cache=False, case_sensitive=True)
        self.words = words

    async def get_suggestion(self, value: str) -> str | None:
        """The whole text with its last word completed, None when no name begins so."""
        match = _LAST_WORD.search(value)
        if match is None:
            return None
        typed = match[0]
        return next(
            (value + word[len(typed) :] for word in self.words if word.startswith(typed) and word != typed), None
        )


class PromptField(Input):
    """The line to type in."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "submit", "accept", tooltip="accept what was typed"),
    ]


class Prompt(Vertical):
    """Hidden until `ask`; enter sends `Answered`, escape hides it again."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "cancel", "cancel", tooltip="leave everything as it was"),
        Binding("tab", "complete", "complete", tooltip="take the completion shown"),
    ]

    class Answered(Message):
        """What was typed, checked; `purpose` as given to `ask`."""

        def __init__(self, purpose: str, text: str) -> None:
            super().__init__()
            self.purpose = purpose
            self.text = text

    class Closed(Message):
        """The prompt was left."""

    def __init__(self) -> None:
        super().__init__()
        self.purpose = ""
        self._check: Check = lambda text: ""

    def compose(self) -> ComposeResult:
        """A line to type in and a line that judges it."""
        yield PromptField(compact=True, select_on_focus=False)
        yield Label(id="validity", markup=False)

    def ask(self, purpose: str, text: str, hint: str, check: Check, words: Sequence[str] = ()) -> None:
        """Open with a text to edit; `hint` is shown while it is empty."""
        self.purpose = purpose
        self._check = check
        field = self.query_one(Input)
        field.suggester = WordSuggester(words) if words else None
        field.placeholder = hint
        field.value = text
        field.cursor_position = len(text)
        self.add_class("open")
        field.focus()
        self._judge(text)

    @property
    def is_open(self) -> bool:
        """Whether it asks."""
        return self.has_class("open")

    def on_input_changed(self, event: Input.Changed) -> None:
        """Judge every keystroke."""
        event.stop()
        self._judge(event.value)

    def _judge(self, text: str) -> str:
        wrong = self._check(text)
        verdict = f"invalid: {wrong}" if wrong else "valid" if text.strip() else "empty: everything is shown"
        if self.purpose != "filter" and not text.strip():
            verdict = ""
        self.query_one("#validity", Label).update(plain(verdict))
        self.set_class(bool(wrong), "invalid")
        return wrong

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Send the answer when it can be read; stay open when not."""
        event.stop()
        if self._judge(event.value):
            return
        self._close()
        self.post_message(self.Answered(self.purpose, event.value))

    def action_cancel(self) -> None:
        """Leave without an answer."""
        self._close()

    def action_complete(self) -> None:
        """Take the completion shown."""
        self.query_one(Input).action_cursor_right()

    def _close(self) -> None:
        self.remove_class("open")
        self.post_message(self.Closed())
