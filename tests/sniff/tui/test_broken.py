"""What breaks the terminal UI is no end like any other: it is said in a line, and the exit code tells it."""

from __future__ import annotations

from functools import partialmethod
from pathlib import Path
from typing import Any

import pytest
from textual.app import App

from sniff.cli import main
from sniff.tui import _close
from sniff.tui.app import SnifferApp

CLEAN = Path(__file__).parents[3] / "captures" / "rtu-clean.cap.txt"


@pytest.mark.parametrize("traced", [False, True])
def test_it_is_one_line_and_an_exit_code(
    traced: bool, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def breaks(self: Any) -> None:
        raise ValueError("it broke")

    monkeypatch.setattr(App, "run", partialmethod(App.run, headless=True))
    monkeypatch.setattr(SnifferApp, "poll", breaks)
    monkeypatch.setattr("sniff.cli.arguments.on_terminal", lambda: True)
    code = main(["open", str(CLEAN), *(["--traceback"] if traced else [])])
    out, err = capfd.readouterr()
    assert code == 70
    assert err.splitlines()[-1].startswith("sniff485: internal error: ValueError: it broke (tui/")
    assert ("Traceback" in err) is traced
    assert "locals" not in out + err


class _Closing:
    """A feed that can only be closed."""

    def __init__(self, error: Exception | None = None) -> None:
        self.error, self.closed = error, False

    def close(self) -> None:
        self.closed = True
        if self.error is not None:
            raise self.error


def test_all_are_closed_whatever_one_does() -> None:
    first, second, third = _Closing(), _Closing(ValueError("it broke")), _Closing(OSError())
    assert _close([first, second, third]) is second.error  # type: ignore[list-item]
    assert first.closed
    assert third.closed
