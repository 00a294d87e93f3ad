"""What comes with the program for the system it runs on: the unit of the service, rules for adapters."""

from __future__ import annotations

import sys
from importlib.resources import files
from pathlib import Path

UNIT = "sniff485-box.service"
RULES = "60-sniff485.rules"


def unit(command: str | None = None) -> str:
    """The systemd unit; `command`: path of the program, that of this one when None."""
    return _text(UNIT).replace("@SNIFF485@", command or own_command())


def rules() -> str:
    """The udev rules."""
    return _text(RULES)


def own_command() -> str:
    """How this very program is started, as a unit must say it: an absolute path."""
    script = Path(sys.executable).with_name("sniff485")
    return _word(script) if script.exists() else f"{_word(Path(sys.executable))} -m sniff"


def _word(path: Path) -> str:
    """A path as a unit must write it: quoted where it has spaces in it, and its % is no specifier."""
    text = str(path).replace("%", "%%")
    if not any(one.isspace() or one in "\"'\\" for one in text):
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _text(name: str) -> str:
    return files("sniff.box").joinpath("data", name).read_text(encoding="utf-8")
