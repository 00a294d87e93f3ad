"""What the lines of one log mean, told by its first lines together: which label's lines hold the octets, which repeat
them, whether a line is a frame, and how numbers are written. Pure.

A log names what it does in its own words ("Processing", "Getting Frame"), and nobody can list them all. So a label is
judged by its lines: those that are mostly found in octets told by others repeat them. Labels that say a direction count
more than others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise

from dissectors.checksums import ends_with_crc16
from sniff.formats.dump_plan import heads_of, offsets_of
from sniff.formats.log_lines import Kind, Line, key_of, line_of, numbers_of
from sniff.formats.log_margin import NO_MARGIN, Margin, margin_of
from sniff.formats.log_numbers import base_of
from sniff.formats.log_octets import PAIRS_ONLY
from sniff.formats.log_outline import Outline, outlines_of, short_line
from sniff.formats.log_repeats import FEW, doubled, echoing, growing
from sniff.formats.log_rewriting import are_codes, as_codes, with_escapes
from sniff.formats.log_shapes import PORTMON, Role
from sniff.formats.log_spellings import SURELY
from sniff.formats.log_times import AS_WRITTEN, FASTEST, Times, counted, number_ahead, order_of
from sniff.formats.usb_serial import STATUS, begin_with_status

LOOKED_AT = 2000
"""Lines of a log that are looked at."""

LOOKED_AT_CHARACTERS = 200_000
"""Characters of them."""

WINDOW = 2048
"""Octets within which a line that repeats others is looked for."""

_STRINGS = "byte strings"
_JOINED, _SHORT = "digits without space", 6
"""Digits of the shortest frame, on lines of which longer ones are known."""

_NUMBERS = "numbers"
_REPEATS = 0.6
_NUMBERED = 0.6
_MOSTLY = 0.8
_TELLING = 3
_NO_WORD = 64  # octets of one line that stands alone under a letter
_BACK = 0.2
_NAMES_LEAST = 6
_FIXED_LEAST = 3  # lines of one width, before they are taken for the width of a table
_WIDTHS = (8, 10, 12, 16, 20, 24, 32, 40, 48, 64)


@dataclass(frozen=True, slots=True)
class Plan:
    """How a log is read. `kind`: of what tool or sort it is; `base`: of numbers (`octets_in`); `offsets`: base of the
    offsets of a hexdump, None where there is none. `roles`: what lines with a label mean. `directed`: whether lines
    with octets say a direction, so that others need a reason to count. `width`: octets of the lines of a table without
    offsets, whose ends say nothing; None where a line is a frame, or part of one that a tool got at once. `octetwise`:
    an octet a line. `bit_samples`: samples of a bit, of a logic analyser; 0 where there are none.
    `spellings`: how octets are written. `margin`, `times`: what is no part of the lines, how their times are read.
    `timed`: whether lines have times. `heads`: those above rows that repeat others. `growing`: labels whose lines tell
    what was heard so far, so that the next has the same with more behind; `doubled`: labels and directions whose lines
    all come twice. `labelled`: whether lines with octets have a label; `lower`: whether their digits are small letters;
    `with_status`: whether what a USB adapter sent begins with its status; `in_codes`: whether digits behind # are
    decimal.
    """

    kind: str
    base: int = PAIRS_ONLY
    offsets: int | None = None
    roles: dict[str, Role | None] = field(default_factory=dict)
    directed: bool = False
    width: int | None = None
    octetwise: bool = False
    bit_samples: float = 0.0
    spellings: frozenset[str] = frozenset()
    margin: Margin = NO_MARGIN
    times: Times = AS_WRITTEN
    timed: bool = False
    labelled: bool = False
    lower: bool = False
    heads: frozenset[str] = frozenset()
    growing: frozenset[str] = frozenset()
    doubled: frozenset[tuple[str, str]] = frozenset()
    with_status: bool = False
    in_codes: bool = False
    outlines: frozenset[Outline] = frozenset()

    def line(self, text: str) -> Line:
        """A line taken apart as this log writes it."""
        text = self.margin.without(text)
        text = as_codes(text) if self.in_codes else text
        line = line_of(text, self.base, self.offsets is not None, self.times)
        if self.outlines and self._may_be_short(line):
            line = short_line(text, self.base, self.times, self.outlines) or line
        if self.with_status and _is_of_adapter(line):
            line = replace(line, octets=line.octets[STATUS:], kind=line.kind if line.octets[STATUS:] else Kind.SHAPE)
        is_other = line.kind in (Kind.TEXT, Kind.STRANGE) or line.spelling == "one octet"
        if is_other and _JOINED in self.spellings and self.offsets is None:
            short = line_of(text, self.base, False, self.times, _SHORT)
            if short.family and self.roles.get(short.family) is Role.DATA:
                return short
        if line.spelling != _STRINGS and _STRINGS in self.spellings and (escaped := with_escapes(text)) != text:
            string = line_of(escaped, self.base, False, self.times)
            if string.bare or self.roles.get(string.family) is Role.DATA:
                return string
        return line

    def _may_be_short(self, line: Line) -> bool:
        """Whether a line has no octets of its own, or few, of which its label says nothing."""
        if line.kind is Kind.OCTETS:
            return len(line.octets) < _TELLING and not line.tool and self.roles.get(line.family) is not Role.DATA
        return line.kind in (Kind.TEXT, Kind.STRANGE) or line.role is Role.HEADING

    def role(self, line: Line, recent: bytes) -> Role | None:
        """What a line with octets is; None: nobody knows. `recent`: the octets told last."""
        if line.role is not None:
            return line.role
        if line.wordy and line.bare and (line.lower is not self.lower or (self.labelled and len(line.octets) > 2)):
            return Role.NOTHING  # "be a bad fed"
        if line.family in self.roles and not line.bare:
            role = self.roles[line.family]
            return Role.NOTHING if role is None and (line.wordy or len(line.octets) < _TELLING) else role
        if line.spelling == "one octet" and not line.bare:
            return Role.NOTHING  # behind a label that no line of octets has: a length, an address
        if line.bare or line.way:
            return Role.DATA
        if line.octets in recent:
            return Role.SAME
        return None if self.directed or len(line.octets) < 3 else Role.DATA


def plan_of(texts: Sequence[str]) -> Plan | None:
    """The plan for a log that begins so; None when no line of it tells octets."""
    margin = margin_of(texts)
    plain = [margin.without(text) for text in margin.joined(texts)]
    in_codes = are_codes(plain)
    found = _plan([as_codes(text) for text in plain] if in_codes else plain)
    return replace(found, margin=margin, in_codes=in_codes) if found is not None else None


def _plan(texts: Sequence[str]) -> Plan | None:
    base = base_of([numbers_of(text) for text in texts if text.strip()])
    times = order_of(texts)
    lines = [line_of(text, base, times=times) for text in texts]
    offsets = offsets_of(
        [(line, before) for line, before in zip(lines, ["", *texts], strict=False) if line.kind is Kind.ROW]
    )
    rows = sum(len(line.octets) for line in lines if line.kind is Kind.ROW)
    others = sum(len(line.octets) for line in lines if line.kind is Kind.OCTETS)
    if offsets is not None and rows >= others:
        tools = Counter(line.tool for line in lines if line.tool)
        name = f"hexdump ({tools.most_common(1)[0][0]})" if tools else "hexdump"
        timed = any(line.stamp is not None for line in lines)
        return Plan(name, base, offsets, times=times, timed=timed, heads=heads_of(texts, lines))
    lines = [line_of(text, base, False, times) for text in texts]
    ahead = _times_ahead(texts, lines, times)
    if ahead.unit:
        times, lines = ahead, [line_of(text, base, False, ahead) for text in texts]
    times = _steps(lines, times)
    if times.clocks_only:
        lines = [line_of(text, base, False, times) for text in texts]
    plan = _of_labels([line for line in lines if line.kind is not Kind.EMPTY], base)
    if plan is not None:
        told = (
            text for text, line in zip(texts, lines, strict=True) if plan.role(line, b"") is Role.DATA and line.octets
        )
        plan = replace(plan, outlines=outlines_of(told, base, times))
    with_status = begin_with_status([line.octets for line in lines if _is_of_adapter(line)])
    timed = any(line.stamp is not None for line in lines)
    return replace(plan, times=times, timed=timed, with_status=with_status) if plan is not None else None


def _is_of_adapter(line: Line) -> bool:
    """Whether it tells what an adapter sent over USB."""
    return line.tool == "usbmon" and line.way == "Bi" and line.octets != b""


def _times_ahead(texts: Sequence[str], lines: Sequence[Line], times: Times) -> Times:
    """The times with those that numbers ahead of the lines tell, where hardly a line has another."""
    told = [(text, line) for text, line in zip(texts, lines, strict=True) if line.kind is Kind.OCTETS]
    bare = [(text, line) for text, line in told if line.stamp is None or line.stamp.assumed]
    numbers = [(number, line) for text, line in bare if (number := number_ahead(text)) is not None]
    if 2 * len(bare) < len(told) or _NUMBERED * len(bare) > len(numbers):
        return times
    return counted([number for number, _ in numbers], [len(line.octets) for _, line in numbers], times)


def _steps(lines: Sequence[Line], times: Times) -> Times:
    """Whether times that go back again and again are those since the line before, or durations and no times."""
    told = [line for line in lines if line.kind is Kind.OCTETS]
    stamps = [line.stamp for line in told if line.stamp is not None]
    clocks = sum(stamp.dated or stamp.daily for stamp in stamps)
    if clocks:  # what others tell beside them is how long something took
        return replace(times, clocks_only=True) if clocks < len(stamps) <= 2 * clocks else times
    if not stamps:
        return times
    if len(stamps) < _NUMBERED * len(told) or any(line.tool == PORTMON for line in told):
        return replace(times, clocks_only=True)  # how long an answer took, beside answers, or a request
    if len(stamps) < _FIXED_LEAST:
        return times
    changes = [later.time - earlier.time for earlier, later in pairwise(stamps) if later.time != earlier.time]
    back = sum(change < 0 for change in changes) > _BACK * len(changes)
    if back and _are_names([stamp.time for stamp in stamps]):
        return replace(times, clocks_only=True)
    passed = sum(stamp.time for stamp in stamps[1:]) if back else stamps[-1].time - stamps[0].time
    if 4 * passed < FASTEST * sum(len(line.octets) for line in told[1:]):
        return replace(times, clocks_only=True)  # how long a call took: octets take their time on the line
    return replace(times, steps=True) if back else times


def _are_names(times: Sequence[int]) -> bool:
    """Whether numbers are those of devices or lines, and not measured: two alone, and near one another, while an answer
    comes sooner than the next request."""
    return len(times) > _NAMES_LEAST and len(set(times)) <= 2 and 2 * max(times) < 3 * min(times)


def _of_labels(lines: Sequence[Line], base: int) -> Plan | None:
    with_octets = [line for line in lines if line.kind is Kind.OCTETS]
    written = sum(line.kind is not Kind.REMARK for line in lines)
    singles = [line for line in with_octets if line.spelling == "one octet"]
    known = [line for line in with_octets if line.tool]
    ways = {line.family for line in singles if line.way}
    multiple = {line.family for line in with_octets if line.spelling != "one octet"}
    # words that end in "be" or "20" are no octets, but the rest of a frame is, and so is what is nothing but octets
    many = Counter(line.family for line in singles)
    trusted = {
        family
        for family, count in many.items()
        if 2 * count >= written and (not family or family in ways or count > max(2, _MOSTLY * written))
    } | (multiple - {""})
    keys = {key_of(family) for family in multiple} - {""}
    trusted |= {family for family in many if key_of(family) in keys}
    with_octets = [line for line in with_octets if line.spelling != "one octet" or line.tool or line.family in trusted]
    if not with_octets:
        return None
    amounts: Counter[str] = Counter()
    directed: set[str] = set()
    for line in with_octets:
        amounts[line.family] += len(line.octets)
        if line.way or line.tool:
            directed.add(line.family)
    checked = _checked(with_octets)
    directed |= checked
    main = max(amounts, key=lambda name: amounts[name])
    best = max((name for name in amounts if name in directed), key=lambda name: amounts[name], default=None)
    if best is not None and 4 * amounts[best] >= amounts[main]:
        main = best
    roles = _roles(with_octets, main, directed, checked) | dict.fromkeys(echoing(with_octets, main), Role.SAME)
    data = [line for line in with_octets if line.tool or line.bare or roles.get(line.family) is Role.DATA]
    told = sum(len(line.octets) for line in data)
    if not data or (told < 3 and not known and written > len(data)):
        return None
    longest = max(len(line.octets) for line in data)
    if (
        main == ""
        and main not in directed
        and 3 * len(data) < written
        and longest < _NO_WORD
        and not _are_headed(lines)
        and not any(len(line.octets) >= SURELY and ends_with_crc16(line.octets) for line in data)
    ):
        return None  # a word here and there
    octetwise = 2 * sum(len(line.octets) == 1 for line in data) > len(data)
    return Plan(
        _name(data, lines), base, None, roles, main in directed, _width(data), octetwise,
        _bit_samples([line.samples for line in data if line.samples is not None]),
        frozenset(line.spelling for line in data), growing=growing(data), doubled=doubled(data),
        labelled=main != "", lower=2 * sum(line.lower for line in data) > len(data),
    )  # fmt: skip


def _are_headed(lines: Sequence[Line]) -> bool:
    """Whether above nearly all lines of octets stands one that says their time or direction; one alone does where a
    known tool says a direction."""
    blocks = headed = known = 0
    head = in_block = is_known = False
    for line in lines:
        if line.kind is Kind.OCTETS and line.bare:
            blocks += not in_block
            headed += head and not in_block
            known += is_known and not in_block
            in_block, head, is_known = True, False, False
        elif line.kind in (Kind.TEXT, Kind.SHAPE):
            head = (head and not in_block) or line.stamp is not None or bool(line.way)
            is_known = (is_known and not in_block) or (line.role is Role.HEADING and bool(line.way))
            in_block = False
    return (blocks >= _FIXED_LEAST and headed >= _MOSTLY * blocks) or 0 < blocks == known


def _checked(lines: Sequence[Line]) -> set[str]:
    """Labels of which most lines are messages that end with their check: they say octets, whatever their words are."""
    many, good = Counter[str](), Counter[str]()
    for line in lines:
        many[line.family] += 1
        good[line.family] += len(line.octets) > SURELY and ends_with_crc16(line.octets)
    return {family for family in good if family and 2 * good[family] > many[family]}


def _roles(lines: Sequence[Line], main: str, directed: set[str], checked: set[str]) -> dict[str, Role | None]:
    """What lines with each label mean."""
    text = b"".join(line.octets for line in lines if line.family == main)
    many_of = Counter(line.family for line in lines)
    usual = {line.spelling for line in lines if line.family == main}
    alike = {line.family for line in lines if line.spelling in usual}
    seen: dict[str, list[int]] = {}
    stretches = Counter(family for family, _ in groupby(line.family for line in lines))
    key = key_of(main)
    at = 0
    for before, line in zip([None, *lines], lines, strict=False):
        if line.family == main:
            at += len(line.octets)
            continue
        count = seen.setdefault(line.family, [0, 0, 0])
        count[0] += 1
        if many_of[line.family] < FEW:  # the begin of an answer that was cut is found in others, too
            told = [before.octets] if before is not None else []
            count[1] += any(
                line.octets in one for one in (*told, *(one.octets[1:] for one in lines if one.family == main))
            )
        else:
            count[1] += line.octets in text[max(0, at - WINDOW) : at + WINDOW]
        count[2] += len(line.octets)
    roles: dict[str, Role | None] = {main: Role.DATA}
    said = {line.way for line in lines if line.family == main}
    one_way = main in directed and len(said) == 1  # what goes the other way has another label
    for family, (many, found, octets) in seen.items():
        if family == "":
            roles[family] = Role.DATA
        elif (
            found >= _REPEATS * many
            and (octets >= _TELLING * many or (many >= _FIXED_LEAST and family not in directed))  # a few are anywhere
            and stretches[family] >= min(many, _FIXED_LEAST)  # between the others: a master asks the same for ever
        ):
            roles[family] = Role.SAME
        elif _by_another_sign(main, family, lines, main in checked):
            roles[family] = None
        elif (
            family in directed
            or ((main not in directed or (one_way and octets > 4 * many)) and family in alike)
            or (key and key_of(family) == key)
        ):
            roles[family] = Role.DATA
        else:
            roles[family] = None
    return roles


def _by_another_sign(main: str, family: str, lines: Sequence[Line], checked: bool) -> bool:
    """Whether lines have numbers that may be octets where a known tool, or messages with their check, are written so
    that they are sure."""
    is_sure = all(
        (line.tool or checked) and not line.spelling.startswith(_NUMBERS) for line in lines if line.family == main
    )
    return is_sure and all(line.spelling.startswith(_NUMBERS) for line in lines if line.family == family)


def _width(data: Sequence[Line]) -> int | None:
    """The width of a table, whose lines end where it is full: all but the last of a block are as long."""
    if any(line.way or line.stamp or not line.bare for line in data):
        return None
    lengths = [len(line.octets) for line in data]
    widest = max(lengths)
    full = lengths.count(widest)
    is_table = widest in _WIDTHS and full >= _FIXED_LEAST and full >= 0.8 * (len(lengths) - 1) and lengths[0] == widest
    return widest if is_table and (widest > 8 or len(set(lengths)) > 1 or len(lengths) > 8) else None


def _bit_samples(samples: Sequence[tuple[int, int]]) -> float:
    """Samples of a bit: an octet's annotation is eight bits wide."""
    widths = sorted(end - begin for begin, end in samples if end > begin)
    return widths[len(widths) // 2] / 8 if widths else 0.0


def _name(data: Sequence[Line], lines: Sequence[Line]) -> str:
    tools = Counter(line.tool for line in lines if line.tool)
    if tools:
        return tools.most_common(1)[0][0]
    spelling = Counter(line.spelling for line in data).most_common(1)[0][0]
    stamped = sum(line.stamp is not None for line in data)
    directed = sum(bool(line.way) for line in data)
    words = [word for word, many in (("times", stamped), ("directions", directed)) if 2 * many > len(data)]
    return f"{', '.join(words)} and {spelling}" if words else spelling
