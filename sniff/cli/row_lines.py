"""Lines for people, many at a time: what `rows.text_line` says of each row, from columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from dissectors.columns import NONE, VERDICTS, Masks, Times
from dissectors.manifest import Dissector
from dissectors.tracker import Interval
from dissectors.words import milliseconds
from sniff.analysis.wording import duration
from sniff.bus import row_words as rows
from sniff.cli.byte_columns import Chosen, Codes, Column, digits, encoded, fixed_digits, pieced, since
from sniff.cli.distinct import distinct_codes
from sniff.cli.merged_columns import merged
from sniff.cli.said_texts import SaidTexts
from sniff.engine.column_join import SettledRows
from sniff.engine.session import Session

_US, _HALF = np.uint64(1000), np.uint64(500)
_EXACT = np.uint64(1 << 52)
"""ns up to which a float of seconds rounds to microseconds as the number does, ties apart."""


class RowLines:
    """Makes the lines of the rows of one capture."""

    def __init__(self, dissector: Dissector, session: Session, colour: bool = False) -> None:
        self._dissector = dissector
        self._session = session
        self._colour = colour
        self._texts = SaidTexts(dissector, encoded)
        self._told = _Told()

    def lines(self, settled: SettledRows, places: Times) -> Iterator[bytes]:
        """The lines of rows at some places, in parts."""
        table = settled.table
        texts, notes, alone = self._texts.column(table, places)
        passed = since(table.frames.start[places], self._session.started)
        rest = passed % _US
        micros = passed // _US + (rest > _HALF)
        alone |= (rest == _HALF) | (passed >= _EXACT)
        which = settled.which[places - settled.begin]
        bad, told = self._told.of(settled, np.where(_is_last(settled, places, which), which, -1))
        noted = self._texts.notes
        bad |= np.array([trouble for trouble, _ in noted] or [False], bool)[notes]
        columns: list[Column] = [
            *([Chosen.of([b"", b"\x1b[31m"], bad.view(np.uint8))] if self._colour else []),
            digits(places + table.first, 6), b" ", *self._seconds(micros.astype(np.int64)), b"  ",
            Chosen.of([b"  ", b"! "], bad.view(np.uint8)), texts, self._noted(notes, told, [note for _, note in noted]),
            *([Chosen.of([b"\n", b"\x1b[0m\n"], bad.view(np.uint8))] if self._colour else [b"\n"]),
        ]  # fmt: skip
        return pieced(merged(columns), alone, lambda at: self._alone(settled, int(places[at])))

    def _seconds(self, micros: Times) -> list[Column]:
        """Seconds with microseconds, from them."""
        if not self._session.has_times:
            return [encoded(rows.NO_TIME)]
        return [digits(micros // _US // _US, 5), b".", fixed_digits(micros % (_US * _US), 6), b" s"]

    def _alone(self, settled: SettledRows, place: int) -> bytes:
        line = rows.text_line(settled.item(place), self._dissector, self._session, self._colour)
        return encoded(line) + b"\n"

    def _noted(self, notes: Codes, told: Times, noted: Sequence[str]) -> Column:
        """What stands in brackets behind the texts."""
        distinct, codes = distinct_codes(told * max(len(noted), 1) + notes)
        texts = []
        for one in distinct.tolist():
            code, note = divmod(one, max(len(noted), 1))
            both = [text for text in (noted[note] if noted else "", self._told.text(code)) if text]
            texts.append(encoded(f"  [{'; '.join(both)}]" if both else ""))
        return Chosen.of(texts, codes)


_BAD = np.array([verdict.value not in rows.GOOD_VERDICTS for verdict in VERDICTS])
_WORDS = ["", *(verdict.words if verdict.value not in rows.GOOD_VERDICTS else "" for verdict in VERDICTS)]
_UNITS = ((1_000_000, 10_000), (100_000_000, 100_000), (1_000_000_000_000, 1_000_000))
"""ns below which times are said in steps of so many ns."""
_STEPS = (0, 1_000, 3_000, 2_000_000)
"""Where the codes of times of each unit begin; behind them: of those that are put into words one by one."""


class _Told:
    """What the last row of a transaction tells of it, by code: its verdict where that is bad, and how long it took."""

    def __init__(self) -> None:
        self._texts: list[str] = []
        self._codes: dict[tuple[int, int, int], int] = {}

    def of(self, settled: SettledRows, which: Times) -> tuple[Masks, Times]:
        """Whether that is bad, and the code, of each place in `settled.closed`; -1 for nothing: code 0."""
        if len(self._texts) >= _MOST_TEXTS:
            self._texts.clear()
            self._codes.clear()
        closed, there = settled.closed, np.flatnonzero(which >= 0)
        bad, codes = np.zeros(len(which), bool), np.zeros(len(which), np.int64)
        if not len(there):
            return bad, codes
        at = which[there]
        verdict, nominal = closed.verdict[at].astype(np.int64), closed.latency[at]
        bad[there] = _BAD[verdict]
        exact = (closed.least[at] == nominal) & (closed.most[at] == nominal) & (nominal >= 0)
        times = np.zeros(len(at), np.int64)
        timed = nominal != NONE
        left, least = timed.copy(), 0
        for begin, (below, unit) in zip(_STEPS, _UNITS, strict=False):
            inside = exact & (nominal >= least) & (nominal < below) & (nominal % unit != unit // 2)
            times[inside] = 1 + begin + (nominal[inside] + unit // 2) // unit
            left &= ~inside
            least = below
        for place in np.flatnonzero(left).tolist():
            one = at[place]
            interval = int(nominal[place]), int(closed.least[one]), int(closed.most[one])
            times[place] = 1 + _STEPS[-1] + self._code(interval)
        codes[there] = times * len(_WORDS) + verdict + 1
        return bad, codes

    def text(self, code: int) -> str:
        """What a code stands for."""
        time, verdict = divmod(code, len(_WORDS))
        words = _WORDS[verdict]
        if not time:
            return words
        time -= 1
        if time >= _STEPS[3]:
            took = self._texts[time - _STEPS[3]]
        elif time >= _STEPS[2]:
            took = f"{time - _STEPS[2]} ms"
        else:
            took = f"{(time - _STEPS[1]) / 10:.1f} ms" if time >= _STEPS[1] else f"{time / 100:.2f} ms"
        return f"{words}; {took}" if words else took

    def _code(self, interval: tuple[int, int, int]) -> int:
        code = self._codes.get(interval)
        if code is None:
            nominal, least, most = interval
            exact = least == nominal == most
            self._texts.append(milliseconds(nominal) if exact else duration(Interval(nominal, least, most)))
            code = self._codes[interval] = len(self._texts) - 1
        return code


_MOST_TEXTS = 1 << 15


def _is_last(settled: SettledRows, at: Times, which: Times) -> Masks:
    """Whether a row is the one that its transaction's verdict is told at."""
    closed = settled.closed
    if not len(closed):
        return np.zeros(len(at), bool)
    response = closed.response[which]
    told = np.where(response > 0, response, closed.request[which])
    is_last: Masks = (which >= 0) & (told == at + settled.table.first)
    return is_last
