"""A device profile drafted from what was heard of a station, as a TOML document to be corrected by hand. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence

from dissectors.findings import counted
from dissectors.profiles.decoding import number, plain_name
from dissectors.profiles.model import Kind
from dissectors.words import brief
from sniff.analysis.register_guess import RegisterGuess
from sniff.analysis.register_kinds import GuessSureness, Use

_HOW = {
    GuessSureness.SURE: "sure",
    GuessSureness.LIKELY: "likely",
    GuessSureness.OPEN: "open: other readings fit as well",
}
_USES = {
    Use.CONSTANT: "never changed",
    Use.SENSOR: "moves up and down",
    Use.COUNTER: "only grows",
    Use.SETTING: "written by a master",
    Use.BITS: "single bits come and go",
}


def drafted(name: str, family: str, protocols: Sequence[str], guesses: Iterable[RegisterGuess]) -> str:
    """The document for one device. `protocols`: registry names it was heard with; `family`: theirs (`Dissector`).

    A register of one table is another thing than the one of the same number in the other table: each is described.
    """
    held = sorted(guesses, key=lambda one: (one.space != "holding", one.address))
    both = {one.space for one in held}
    tables = [space for space in ("holding", "input") if space in both] or ["holding"]
    lines = [
        "# Drafted from a capture: types and orders are guesses, each with how sure it is. Names, units and scales",
        "# are to be filled in by hand; `sniff485 profile check` says what is wrong with the document.",
        "",
        f"name = {_quoted(name)}",
        f"title = {_quoted(f'{name} (draft)')}",
        f"protocols = [{', '.join(map(_quoted, protocols))}]",
        "",
        f"[{family}]",
        f"tables = [{', '.join(map(_quoted, tables))}]",
    ]
    for guess in held:
        lines += ["", *_register(family, guess, of_table=len(tables) > 1)]
    return "\n".join(lines) + "\n"


def told(guess: RegisterGuess) -> str:
    """What was seen of a register, in a line."""
    if guess.low == guess.high:
        span = f"always {number(guess.low)}"
    else:
        span = f"{number(guess.low)} … {number(guess.high)}, {counted(guess.changes, 'change')}"
        span += f", {brief(guess.rate, 3)} a second"
    return f"{_HOW[guess.sure]}; {_USES[guess.use]}; {span} in {counted(guess.answers, 'answer')}"


def _register(family: str, guess: RegisterGuess, of_table: bool) -> list[str]:
    place = plain_name(guess.space, guess.address).replace("/", "-")
    lines = [
        f"# {told(guess)}",
        f"[[{family}.register]]",
        f"address = 0x{guess.address:04X}",
        f"name = {_quoted(place)}",
    ]
    if of_table:
        lines.append(f"tables = [{_quoted(guess.space)}]")
    if guess.kind is not Kind.U16:
        lines.append(f"type = {_quoted(guess.kind.value)}")
    if guess.swapped:
        lines.append('word-order = "low-first"')
    if guess.little:
        lines.append('octet-order = "low-first"')
    if guess.use is not Use.SETTING:
        lines.append('access = "r"')
    if guess.sure is not GuessSureness.SURE:
        lines.append(f"doubt = {_quoted('guessed from a capture')}")
    return lines


def _quoted(text: str) -> str:
    """A TOML basic string: what JSON escapes, TOML reads."""
    return json.dumps(text, ensure_ascii=True)
