"""The line that asks for something (a filter, a place to go to) and says while one types whether it can be read."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.events import Key
from textual.message import Message
from textual.suggester import Suggester
from textual.widgets import Input, Label

from sniff.analysis.sanitizing import sanitized
from sniff.filter.completion import Completion

Check = Callable[[str], str]
"""Gives what is wrong with a text, an empty string when nothing is."""

Complete = Callable[[str], Sequence[Completion]]
"""Gives the ways in which a filter may go on."""
MOST_OFFERED = 8
NOTICES_ABOVE = 4
"""Lines of the prompt, the two of its verdict among them, and of the keys."""

_LAST_WORD = re.compile(r"[A-Za-z_][\w.]*$")


class AskedOnce:
    """Ways in which a filter may go on, worked out once for a text: suggestion, list and enter ask the same."""

    def __init__(self, complete: Complete) -> None:
        self._complete = complete
        self._text: str | None = None
        self._ways: Sequence[Completion] = ()

    def __call__(self, text: str) -> Sequence[Completion]:
        """The ways."""
        if text != self._text:
            self._text, self._ways = text, self._complete(text)
        return self._ways


class FilterSuggester(Suggester):
    """Completes a filter: the first way to go on (tab or → takes it)."""

    def __init__(self, complete: Complete) -> None:
        super().__init__(use_cache=False, case_sensitive=True)
        self.complete = complete

    async def get_suggestion(self, value: str) -> str | None:
        """The whole text as it may go on, None when nothing fits; only what begins as it was typed."""
        return next((one.text for one in self.complete(value) if value and one.text.startswith(value)), None)


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

    async def _on_key(self, event: Key) -> None:
        """A key behind the answer is no part of it: enter answers here, not when it has bubbled up to the bindings."""
        prompt = self.parent
        assert isinstance(prompt, Prompt)
        if not prompt.is_open:
            prompt.post_message(prompt.KeyBehind(event.key, event.character))
        elif event.key == "enter":
            prompt.answer(self.value)
        else:
            return
        event.stop()
        event.prevent_default()


class Prompt(Vertical):
    """Hidden until `ask`; enter sends `Answered`, escape hides it again."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "cancel", "cancel", tooltip="leave everything as it was"),
        Binding("tab", "complete", "complete", tooltip="take the completion shown"),
        Binding("up", "before(-1)", "before", tooltip="what was asked for before", show=False),
        Binding("down", "before(1)", "before", tooltip="what was asked for after it", show=False),
    ]

    class Answered(Message):
        """What was typed, checked; `purpose` as given to `ask`."""

        def __init__(self, purpose: str, text: str) -> None:
            super().__init__()
            self.purpose = purpose
            self.text = text

    class Closed(Message):
        """The prompt was left."""

    class KeyBehind(Message):
        """A key was pressed behind the answer, before the screen had its keys again; comes after `Closed`."""

        def __init__(self, key: str, character: str | None) -> None:
            super().__init__()
            self.key = key
            self.character = character

    def __init__(self) -> None:
        super().__init__()
        self.display = False
        self.purpose = ""
        self._check: Check = lambda text: ""
        self._complete: Complete | None = None
        self._before: Sequence[str] = ()
        self._at = 0
        self._said: str | None = None  # in the line that judges

    def compose(self) -> ComposeResult:
        """A line to type in and a line that judges it."""
        yield PromptField(compact=True, select_on_focus=False)
        yield Label(id="validity", markup=False)

    def ask(
        self,
        purpose: str,
        text: str,
        hint: str,
        check: Check,
        words: Sequence[str] = (),
        complete: Complete | None = None,
        before: Sequence[str] = (),
    ) -> None:
        """Open with a text to edit; `hint` is shown while it is empty. `complete`: ways in which a filter may go on.
        `before`: what was answered earlier, the latest last."""
        self.purpose = purpose
        self._check, self._complete = check, AskedOnce(complete) if complete is not None else None
        self._before, self._at = before, len(before)
        field = self.query_one(Input)
        asked = self._complete
        field.suggester = FilterSuggester(asked) if asked else WordSuggester(words) if words else None
        field.placeholder = hint
        field.value = text
        field.cursor_position = len(text)
        self.display = True  # not by a class: the sheets would be matched to all that is in it
        self._lift_notices(NOTICES_ABOVE)
        field.focus()
        self._judge(text)

    @property
    def is_open(self) -> bool:
        """Whether it is to be seen."""
        return self.display

    def on_input_changed(self, event: Input.Changed) -> None:
        """Judge every keystroke."""
        event.stop()
        self._judge(event.value)

    def _judge(self, text: str) -> str:
        wrong = self._check(text)
        verdict = f"invalid: {wrong}" if wrong else "valid" if text.strip() else "empty: everything is shown"
        if self.purpose != "filter" and not text.strip():
            verdict = ""
        if self._complete is not None:
            verdict = f"{verdict}{self._ways(text)}"
        if verdict != self._said:  # every update lays the whole screen out
            self._said = verdict
            self.query_one("#validity", Label).update(sanitized(verdict))
        self.set_class(bool(wrong), "invalid")
        return wrong

    def _ways(self, text: str) -> str:
        """How it may go on, with how many rows have a value."""
        assert self._complete is not None
        ways = self._complete(text)[:MOST_OFFERED] if text else ()
        offered = [one.word if one.rows is None else f"{one.word} ×{one.rows}" for one in ways]
        return f"    {'  '.join(offered)}" if offered else ""

    def action_before(self, step: int) -> None:
        """An earlier answer, or the one after it."""
        if self._before:
            self._at = min(max(0, self._at + step), len(self._before))
            field = self.query_one(Input)
            field.value = self._before[self._at] if self._at < len(self._before) else ""
            field.cursor_position = len(field.value)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Accepted by its binding."""
        event.stop()
        self.answer(event.value)

    def answer(self, text: str) -> None:
        """Send the answer when it can be read; stay open when not. What is asked for and that it is closed is drawn
        at once."""
        if self.is_open and not self._judge(text):
            self.post_message(self.Answered(self.purpose, text))
            self._close()

    def action_cancel(self) -> None:
        """Leave without an answer."""
        self._close()

    def action_complete(self) -> None:
        """Take the completion shown."""
        self.query_one(Input).action_cursor_right()

    def _close(self) -> None:
        self.display = False
        self._lift_notices(1)
        self.post_message(self.Closed())

    def _lift_notices(self, lines: int) -> None:
        """Notices stand so many lines above the end of the screen: what is typed is not covered by them."""
        for rack in self.screen.query("#textual-toastrack"):
            rack.styles.margin = (0, 0, lines, 0)
