"""A stretch of octets that ends with CR, silence or 256 octets, taken apart into frames and what is none.

What stands in it is decided when its end is seen, because its begin proves little: junk before an answer may be text,
`A` is a hex digit too, and a flipped bit makes a `6` a `>`. So the end is asked first: which good frame ends there?

1. The last `>` with a good command behind it begins that command, whatever stands before.
2. A stretch that is one good frame is that frame. At the begin of a capture, where a line may have been joined in its
   middle, an answer must prove itself by its checksum; and until a frame has, answers without one (`A` CR, `N` EE CR)
   are noise: any bus may carry such octets.
3. A good answer that ends a bad stretch is cut out where it begins after proved silence; or, while a command waits for
   it, where it may answer that command and what stands before it is no answer itself: at most STRAY octets, an octet
   that is no text, or the whole command that lost its CR. Behind the command that waits, given back at once without
   its last one or two octets, any answer to it is believed: the two together may look like another command.
4. What is left is one damaged frame where it looks like one: text, that begins with `>`, or where an answer is due.
   One thing put right at one of its ends may show what it was (`Repair`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, NamedTuple

from dissectors.frame import Check, Damage, Repair
from dissectors.n2.commands import Command, expected_length, parse_command
from dissectors.n2.envelope import (
    ANSWER,
    COMMAND,
    NOT_TEXT,
    REFUSAL,
    is_good,
    judge,
    repaired_answer,
    repaired_command,
)
from dissectors.n2.forms import fits, may_answer
from dissectors.quick_values import quickly_made

STRAY: Final = 3
"""Most octets of junk directly before an answer, as of a driver that is switched on too late."""

SHORTEST: Final = 4
"""Fewest octets of a damaged frame that nobody waits for."""

_ACKNOWLEDGED = b"A\r"
_WITH_CHECK = 6  # octets of the shortest answer with a checksum
_LEAST: Final = 4  # octets of text that may be a damaged frame without its first octet
_STARTS = frozenset((ANSWER, REFUSAL))
_AFTER_NOT_TEXT = re.compile(rb"(?<=[^\x20-\x7e])[AN]")
_MORE_OF_ANSWER = re.compile(rb"[0-9A-Fa-f]*")
_HEX = frozenset(b"0123456789ABCDEFabcdef")


class Before(Enum):
    """What stands before the first octet of a stretch."""

    NOTHING = auto()  # the capture begins
    LINE_END = auto()  # CR, or proved silence
    NOT_TEXT = auto()
    TEXT = auto()


class Piece(NamedTuple):
    """A part of a stretch up to `end`; `check` None: no frame. `split`: cut out of a run that held more."""

    end: int
    check: Check | None = None
    damage: Damage | None = None
    split: bool = False
    repair: Repair | None = None


def good_whole(octets: bytes, before: Before, *, waits: bool, proved: bool) -> Check | None:
    """The check of octets that are one good frame where they stand (rule 2); None where they are none."""
    first = octets[0]
    if first != COMMAND and (
        first not in _STARTS or before is Before.TEXT or (before is Before.NOT_TEXT and not waits)
    ):
        return None
    check, damage = judge(octets)
    return check if damage is None and (check is Check.GOOD or proved) else None


@quickly_made
@dataclass(frozen=True, slots=True)
class N2Stretch:
    """Octets and what is known about them.

    `damage`: why it ended without CR, None where it ends with one. `seams`: where silence was proved inside it.
    `waits`: whether an answer is due; `asked`: the good command that waits for it, `command`: its octets. `proved`:
    whether a checksum was right before: this bus does speak N2. `short`: octets that lacked when the command before
    was given back.
    """

    octets: bytes
    damage: Damage | None
    seams: tuple[int, ...]
    before: Before
    waits: bool
    asked: Command | None
    proved: bool
    command: bytes = b""
    short: int = 0

    def pieces(self) -> list[Piece]:
        """Take it apart; the pieces cover it without a gap."""
        tail: list[list[Piece]] = []
        rest = self
        while at := rest._last_command():
            tail.append([piece._replace(end=piece.end + at) for piece in rest._from(at)._apart()])
            rest = rest._cut_at(at)
        made = rest._apart()
        for pieces in reversed(tail):
            made += pieces
        return made

    def may_hold_frame(self) -> bool:
        """Whether a frame may have begun in it, so that a short silence does not end it."""
        return b">" in self.octets or bool(self._places())

    def last_begin(self) -> int:
        """The last place but the first where a frame may begin; 0 where there is none."""
        return max(self.octets.rfind(b">"), *self._places(), 0)

    def _apart(self) -> list[Piece]:
        """Take apart what holds no command but at its begin."""
        at = self._behind_cut_echo()
        whole = self._whole() if at is None else None
        if whole is not None:
            return [whole]
        at = self._good_answer() if at is None else at
        if at is None:
            return self._damaged()
        check, damage = judge(self.octets[at:])
        left = self._cut_at(at)._damaged() if at else []
        split = at > 0 and left[-1].check is not None
        return [*left, Piece(len(self.octets), check, damage, split)]

    # --- good frames ---

    def _last_command(self) -> int | None:
        """Where a command begins that ends here, behind other octets (rule 1)."""
        octets = self.octets
        at = octets.rfind(b">")
        if at <= 0:
            return None
        if at in self.seams or self.damage is Damage.LONG or not (self.waits or octets[0] == COMMAND):
            return at
        command = octets[at:]
        if self.damage is not None:
            return at if is_good(command + b"\r") else None
        return at if is_good(command) or expected_length(command) == len(command) else None

    def _behind_cut_echo(self) -> int | None:
        """Where the answer begins behind the command that waits for it, given back and cut short."""
        command, octets = self.command, self.octets
        if self.damage is not None or not self.waits or self.asked is None:
            return None
        if octets == command and self.short != len(_ACKNOWLEDGED):
            return None
        for at in (len(command) - 2, len(command) - 1):
            answer = octets[at:]
            if at < _LEAST or octets[:at] != command[:at] or answer[:1] not in (b"A", b"N"):
                continue
            if judge(answer)[1] is None and may_answer(self.asked, answer):
                return at
        return None

    def _whole(self) -> Piece | None:
        """The stretch as one good frame (rule 2)."""
        if self.damage is not None:
            return None
        check = good_whole(self.octets, self.before, waits=self.waits, proved=self.proved)
        return Piece(len(self.octets), check) if check is not None else None

    def _good_answer(self) -> int | None:
        """Where a good answer begins at the end of a bad stretch (rule 3)."""
        best, rank = None, (False, False, False)
        for at in self._good_ends():
            silence = at in self.seams
            told = self._accepts(at, silence)
            if told is None:
                continue
            mine = (told, silence, self.octets[at:] != b"A\r")
            if best is None or mine >= rank:  # of two alike the longer one
                best, rank = at, mine
        return best

    def _good_ends(self) -> Iterator[int]:
        """Where answers begin that would be good, the shortest first."""
        octets = self.octets
        if self.damage is not None:
            return
        size = len(octets)
        sent = int(octets[-3:-1], 16) if size >= 4 and _HEX.issuperset(octets[-3:-1]) else None
        if size >= 2 and octets[-2] == ANSWER:
            yield size - 2
        if size >= 4 and octets[-4] == REFUSAL and sent is not None:
            yield size - 4
        if sent is None:
            return
        total = 0
        for at in range(size - 4, -1, -1):
            octet = octets[at]
            if octet == ANSWER and total == sent:
                yield at
            if not 0x20 <= octet <= 0x7E or octet == COMMAND:
                return
            total = (total + octet) & 0xFF

    def _accepts(self, at: int, silence: bool) -> bool | None:
        """Whether a good answer is believed to begin there: True where it has the form that is asked for."""
        before, answer = self.octets[:at], self.octets[at:]
        has_check = answer[0] == ANSWER and len(answer) >= 4
        asked, waits = self.asked, self.waits
        stray = at <= STRAY and self.before is not Before.TEXT
        for said in (before, before[:-1]):
            if said[:1] == b">" and is_good(said + b"\r"):
                asked, waits, stray = parse_command(said + b"\r"), True, True
        if has_check and self._stands_behind_command(before):
            return False
        if not (has_check or self.proved):
            return None
        begun = len(before) > 1 and before[:1] in (b">", b"A") and _HEX.issuperset(before[1:])
        if answer[0] == REFUSAL and not silence and begun:
            return None  # one spoilt octet of what began there
        if silence and not waits:
            return False
        if not waits or (asked is not None and not may_answer(asked, answer)):
            return False if silence else None
        told = asked is not None and fits(asked, answer) is True
        free = stray or silence or (before != b"" and NOT_TEXT.match(before[-1:]) is not None)
        return told if free or (told and has_check) else None

    def _stands_behind_command(self, before: bytes) -> bool:
        """Whether a damaged command stands there, so that its answer may follow at once: one that ends before its
        length, or has octets in it that are no text."""
        if before[:1] != b">" or len(before) < _LEAST or not self.proved:
            return False
        expected = expected_length(before)
        cut_short = expected is not None and len(before) < expected != len(self.octets)
        return cut_short or NOT_TEXT.search(before) is not None

    # --- damaged ones ---

    def _damaged(self) -> list[Piece]:
        """No good frame ends here (rule 4)."""
        if self.octets[0] == COMMAND:
            told = self._damaged_command()
            if told is not None:
                return [told]
        repaired = self._repaired()
        if repaired is not None:
            return repaired
        size, places = len(self.octets), self._places()
        if self.waits and self.proved and 0 not in places and self._looks_like_remains():
            return [Piece(size, Check.BAD, self.damage or Damage.FORM)]
        for at in places:
            piece = self._answer_from(at)
            if piece is not None:
                return [*self._noise(at), piece]
        return [Piece(size)]

    def _damaged_command(self) -> Piece | None:
        octets, size = self.octets, len(self.octets)
        foreign = len(NOT_TEXT.findall(octets.removesuffix(b"\r")))
        has_address = self.proved and size == _LEAST - 1 and _HEX.issuperset(octets[1:])
        if (size < _LEAST and not has_address) or 4 * foreign > size:
            return None
        check, damage = judge(octets) if self.damage is None else (Check.ABSENT, self.damage)
        return Piece(size, check, damage, repair=repaired_command(octets))

    def _repaired(self) -> list[Piece] | None:
        """A frame whose first octet is missing or spoilt (its octets then begin as no frame does)."""
        octets, size = self.octets, len(self.octets)
        if self.damage is not None or self.before is Before.NOTHING or not self.proved:
            return None
        answers = self.waits and self.asked is not None
        for at in range(min(STRAY + 1, size)):
            rest = octets[at:]
            if rest[0] in _STARTS:
                return None
            repair = repaired_answer(rest, self.asked) if answers else None
            if repair is None or not self._is_asked(repair.octets):
                repair = repaired_command(rest) or repair
            if repair is not None and len(rest) > 1:
                return [*self._noise(at), Piece(size, Check.BAD, Damage.FORM, repair=repair)]
        return None

    def _is_asked(self, answer: bytes) -> bool:
        """Whether an answer has surely the form that is asked for."""
        return self.asked is not None and fits(self.asked, answer) is True

    def _answer_from(self, at: int) -> Piece | None:
        """A damaged answer that begins with its own start character."""
        octets = self.octets[at:]
        size, foreign = len(octets), len(NOT_TEXT.findall(octets.removesuffix(b"\r")))
        if self.before is Before.NOTHING and at == 0 and not self.waits:
            return None
        if not self.waits:
            if foreign or size < _WITH_CHECK:
                return None
        elif size < _LEAST:
            more = octets[1:].removesuffix(b"\r")
            if not _MORE_OF_ANSWER.fullmatch(more) or (not more and not self._may_be_short(octets)):
                return None
        elif 4 * foreign > size:
            return None
        check, damage = judge(octets) if self.damage is None else (Check.ABSENT, self.damage)
        repair = repaired_answer(octets, self.asked) if self.waits else None
        return Piece(at + size, check, damage or Damage.FORM, repair=repair)

    def _may_be_short(self, octets: bytes) -> bool:
        """Whether an `A` alone may be an acknowledgement without its end."""
        return octets == b"A" and self.asked is not None and may_answer(self.asked, b"A\r")

    def _looks_like_remains(self) -> bool:
        octets = self.octets.removesuffix(b"\r")
        if len(octets) < _LEAST - (self.damage is None):
            return False
        hexes = sum(octet in _HEX for octet in octets)
        return 4 * (len(octets) - hexes) <= len(octets)

    # --- parts ---

    def _places(self) -> list[int]:
        """Where an answer may begin, ascending (rules 2 to 4)."""
        octets, size = self.octets, len(self.octets)
        places = {seam for seam in self.seams if seam < size and octets[seam] in _STARTS}
        if self.waits:
            if self.before is not Before.TEXT:
                places.update(at for at in range(min(STRAY + 1, size)) if octets[at] in _STARTS)
            places.update(match.start() for match in _AFTER_NOT_TEXT.finditer(octets))
        elif octets[0] in _STARTS and self.before in (Before.LINE_END, Before.NOTHING):
            places.add(0)
        return sorted(places)

    @property
    def _known(self) -> tuple[bool, Command | None, bool, bytes, int]:
        return self.waits, self.asked, self.proved, self.command, self.short

    def _noise(self, size: int) -> list[Piece]:
        return [Piece(size)] if size else []

    def _cut_at(self, at: int) -> N2Stretch:
        """What stands before the place."""
        seams = tuple(seam for seam in self.seams if seam < at)
        damage = Damage.RESTARTED if self.octets[at : at + 1] == b">" else Damage.FORM
        return N2Stretch(self.octets[:at], damage, seams, self.before, *self._known)

    def _from(self, at: int) -> N2Stretch:
        """What stands from the place on."""
        seams = tuple(seam - at for seam in self.seams if seam > at)
        before = Before.LINE_END if at in self.seams else Before.TEXT
        return N2Stretch(self.octets[at:], self.damage, seams, before, *self._known)
