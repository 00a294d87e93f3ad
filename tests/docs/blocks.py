"""Code blocks of Markdown pages, and what becomes of them when they are carried out in a folder, one after another.

A `console` block holds commands (`$ sniff485 …`), each with the output that it prints, or none where only that it works
matters; a line `…` stands for any lines. What needs a port, a terminal or an end by hand is only parsed; `-w FILE` of
such a command then gives a recording made from a capture. Blocks with a title are files.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import textwrap
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from docs.generate.running import Run, run
from sniff.cli import COMMANDS, command_line

ROOT = Path(__file__).parents[2]
SAMPLE = "captures/rtu-usual-faults.cap.txt"

ENDLESS = frozenset({"live", "record", "box", "demo", "open", "serve", "mcp", "detect", "extcap", "replay"})
"""Commands that need a port or a terminal, or go on until somebody ends them."""

BUSES = frozenset({"boiler", "roof"})
"""Buses of the configuration that the pages have, whose ports are not here."""

_FENCE = re.compile(
    r'^(?P<in> *)```(?P<kind>[\w-]*) *(?:title="(?P<title>[^"]*)")? *\n(?P<text>.*?)^(?P=in)``` *$', re.M | re.S
)
_EXAMPLE = "<!-- an example -->"


@dataclass(frozen=True, slots=True)
class Block:
    """One code block: `line` where it begins, `kind` of its fence, `title`; `is_example`: its output is no promise."""

    line: int
    kind: str
    title: str
    text: str
    is_example: bool


def fenced(text: str) -> Iterator[Block]:
    """The fenced blocks of a page."""
    for match in _FENCE.finditer(text):
        before = text[: match.start()].rstrip().rpartition("\n")[2]
        line = text.count("\n", 0, match.start()) + 1
        text_of = textwrap.dedent(match["text"])
        yield Block(line, match["kind"], match["title"] or "", text_of, before.strip() == _EXAMPLE)


def indented(text: str) -> Iterator[Block]:
    """The blocks of a page that are only indented; what is in them tells their kind."""
    for match in re.finditer(r"(?:(?<=\n\n)|\A)(?:    .*\n(?:\n(?=    ))*)+", text):
        inside = re.sub(r"^    ", "", match[0], flags=re.M)
        first = inside.split("\n", 1)[0]
        kind = (
            "commands" if first.startswith("sniff485 ") else "toml" if first.startswith("[")
            and "=" in inside else "python" if first.startswith(("from ", "import ")) else "picture"
        )  # fmt: skip
        yield Block(text.count("\n", 0, match.start()) + 1, kind, "", inside, False)


def carry_out(block: Block, names: dict[str, Any]) -> list[str]:
    """Do what a block says, in the current folder; what was wrong. `names`: those of Python blocks before."""
    if block.title:
        path = Path(block.title)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.text, encoding="utf-8")
    if block.kind == "python" and not Path(block.title).name.startswith("test_"):  # those pytest runs
        exec(compile(block.text, f"line {block.line}", "exec"), names)  # an exception tells by itself
    elif block.kind == "toml":
        _load(block.text)
    elif block.kind == "console":
        return [said for command, shown in _commands(block.text) for said in _command(command, shown, block.is_example)]
    elif block.kind == "commands":
        lines = [line for line in block.text.splitlines() if line.startswith("sniff485 ")]
        return [said for line in lines for said in _command(line, [], False)]
    elif block.kind == "sh":
        for line in block.text.splitlines():
            if line.startswith("sniff485 "):
                _parse(shlex.split(line.partition(" > ")[0], comments=True)[1:])
    elif block.kind == "text" and block.text.startswith("#!sniff-capture") and "protocol: ping" not in block.text:
        from sniff.formats import read

        path = Path("shown.cap.txt")
        path.write_text(block.text, encoding="utf-8")
        assert list(read(str(path)).items())
    return []


def _load(text: str) -> None:
    from dissectors.profiles.parsing import parse
    from sniff.config import parse as parse_config

    document = tomllib.loads(text)
    if "protocols" in document:
        parse(document, "block.toml")
    elif document.keys() & {"bus", "alert", "filters", "colours", "views", "keys"}:
        path = Path("block.toml")
        path.write_text(text, encoding="utf-8")
        parse_config(path)


def _commands(text: str) -> Iterator[tuple[str, list[str]]]:
    command, shown = "", []
    for line in text.splitlines():
        if line.startswith("$ "):
            if command:
                yield command, shown
            command, shown = line[2:], []
        else:
            shown.append(line)
    yield command, shown


def _command(line: str, shown: list[str], is_example: bool) -> list[str]:
    words = shlex.split(line, comments=True)
    if words[0] == "pytest":
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words[1:]],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        return [] if done.returncode == 0 else [f"{line}: {done.stdout}{done.stderr}"]
    assert words[0] == "sniff485", line
    arguments = words[1:]
    elsewhere = any(word.startswith(("/dev/", "/archive")) or word in BUSES for word in arguments)
    if arguments[0] in ENDLESS or is_example or elsewhere:
        _parse(arguments)
        if "-w" in arguments:
            run(["convert", SAMPLE, arguments[arguments.index("-w") + 1], "--force"])
        return []
    if arguments[0] == "report" and not shown:  # to draw it takes seconds, and `report` has tests of its own
        _parse(arguments)
        return []
    if arguments[0] == "fleet":  # a cluster takes seconds to begin, and has tests of its own, in processes of their own
        arguments = [*arguments, "--workers", "1"]
    said = run(arguments)
    if shown:
        lines = (said.out + said.err).splitlines()
        return [] if _fits(shown, lines) else [f"{line}\n" + "\n".join(lines)]
    return [] if said.code in (0, 1) else [f"{line}: exit code {said.code}: {said.err}"]


def _parse(arguments: list[str]) -> None:
    """Whether the program would take a command line. SystemExit where it would not."""
    assert arguments[0] in COMMANDS or arguments[0].startswith("-"), arguments[0]
    command_line([arguments[0]])[0].parse_args(arguments)


def _fits(shown: list[str], lines: list[str]) -> bool:
    """Whether lines are those shown, where `…` stands for any lines."""
    pattern = "".join("(?:.*\n)*" if line.strip() == "…" else re.escape(line.rstrip()) + "[ ]*\n" for line in shown)
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in lines)) is not None


def furnish(folder: Path) -> None:
    """What pages take for granted: the captures, and some names that the README has."""
    (folder / "captures").mkdir()
    for path in sorted((ROOT / "captures").glob("*.cap.txt")):
        os.symlink(path, folder / "captures" / path.name)


__all__ = ["Block", "Run", "carry_out", "fenced", "furnish", "indented"]
