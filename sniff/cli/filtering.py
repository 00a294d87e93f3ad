"""-Y, wherever frames are read, and the names of fields."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from dissectors import registry
from dissectors.field_types import FieldType, Kind
from dissectors.findings import Finding
from dissectors.line import MS, NS_PER_S
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.tracker import Transaction
from sniff.analysis.sanitizing import sanitized
from sniff.bus.offline import ReadSource, survey
from sniff.bus.second_proof import SecondProof
from sniff.cli import USAGE, Failure, arguments
from sniff.cli.progress import Watched
from sniff.cli.tables import safe_cell
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.engine import Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import Observer
from sniff.engine.session import SECOND_NOTE, Session
from sniff.engine.verdict_join import Wanted
from sniff.filter import Filter, FilterError, Scope, compile_filter
from sniff.filter.compiling import field_of
from sniff.filter.errors import OfOthers, nearest
from sniff.filter.fields import ALIASES, COLUMN_TYPES, column_type, types_of
from sniff.filter.told import TYPES as POINT_TYPES

MOST_WORDS = 12
"""Words of a field that a list names."""


def add_filter(parser: argparse.ArgumentParser, what: str = "only frames that match") -> None:
    """-Y, the same everywhere."""
    parser.add_argument("-Y", dest="filter", metavar="FILTER", default="", help=f"{what} (show --help-fields)")


def add_help_fields(parser: argparse.ArgumentParser) -> None:
    """--help-fields: lists every field and ends."""
    parser.add_argument(
        "--help-fields",
        action=_HelpFields,
        nargs="?",
        metavar="PROTOCOL",
        help="list every field with its type and its words, and end",
    )


def filter_of_both(
    args: argparse.Namespace, capture: ReadSource, session: Session, devices: Devices | None = None
) -> tuple[SecondProof, Filter]:
    """What -Y says, for those who list frames of a second protocol too, and what is known of one. Where it asks for
    what frames of the first cannot have, the whole capture is looked at for a second one first."""
    proof = SecondProof(session)
    try:
        compile_filter(args.filter, dissector_for(session), Scope(session.started, devices or Devices()))
    except OfOthers:
        from sniff.bus.second_protocol import proven

        proof = proven(capture, session, args.reference)
        if proof.name:
            session = replace(session, notes={**session.notes, SECOND_NOTE: proof.name})
    except FilterError:
        pass  # said below
    return proof, filter_of(args, capture, session, devices)


def filter_of(
    args: argparse.Namespace, capture: ReadSource, session: Session, devices: Devices | None = None
) -> Filter:
    """What -Y says, for a capture; ends with exit code 2 where it cannot be read, or asks for what frames of this
    protocol cannot have. Of several captures, one at least must have it."""
    dissector = dissector_for(session)
    scope = Scope(session.started, devices or Devices())
    try:
        return _compiled(args.filter, capture, session, scope)
    except OfOthers as error:
        if of_second(args, session, session.notes.get(SECOND_NOTE, "")) is not None:
            return compile_filter(args.filter, dissector, scope, others=True)
        refused = args.of_others = getattr(args, "of_others", frozenset()) | {id(capture)}
        if len(refused) >= arguments.captures_open():
            raise Failure(f"filter {args.filter!r}: {error}", USAGE) from None
        print(f"sniff485: {sanitized(session.port)}: {sanitized(error)}", file=sys.stderr)
        return compile_filter(args.filter, dissector, scope, others=True)
    except FilterError as error:
        raise Failure(f"filter {args.filter!r}: {error}", USAGE) from None


def of_second(args: argparse.Namespace, session: Session, name: str) -> Filter | None:
    """What -Y says of frames of a second protocol on the bus; None where it asks for what they cannot have."""
    if name not in registry.names():
        return None
    try:
        return compile_filter(args.filter, registry.get(name), Scope(session.started, Devices()))
    except FilterError:
        return None


def _compiled(text: str, capture: ReadSource, session: Session, scope: Scope) -> Filter:
    """The filter with all that it asks for beside the rows: findings, values of points, lines with devices in them."""
    dissector = dissector_for(session)
    wanted = compile_filter(text, dissector, scope)
    if "finding" in wanted.names:
        scope = replace(scope, findings=_evidence(capture, session, scope.devices))
    if wanted.points:
        from sniff.bus.asked_rows import points_told

        points = points_told(capture, session, scope.devices, wanted.points)
        scope = replace(scope, told=points.of, telling=points.telling)
    if "text" in wanted.names and scope.devices:
        from sniff.bus.asked_rows import lines_said

        scope = replace(scope, says=lines_said(capture, session, scope.devices))
    if wanted.by_request:
        from sniff.bus.asked_rows import fields_answered

        scope = replace(scope, answered=fields_answered(capture, session, wanted.by_request))
    again = wanted.points or wanted.by_request or wanted.names & {"finding", "text"}
    return compile_filter(text, dissector, scope) if again else wanted


def surveyed(
    args: argparse.Namespace,
    capture: ReadSource,
    session: Session,
    *observers: Observer,
    every_row: bool = False,
    devices: Devices | None = None,
) -> None:
    """Hand a capture to observers, as far as -Y accepts it; an exchange counts where one of its frames is accepted.

    `every_row`: all rows, and only the exchanges that are accepted."""
    if not args.filter:
        survey(Watched(capture), session, *observers, reference=args.reference)
        return
    from sniff.bus.sifting import sift

    sift(Watched(capture), session, filter_of(args, capture, session, devices), *observers, every_row=every_row)


def sifted(args: argparse.Namespace, capture: Capture, session: Session, devices: Devices | None = None) -> ReadSource:
    """The octets of the rows that -Y accepts; the capture itself without it."""
    if not args.filter:
        return capture
    from sniff.bus.sifting import Sifted

    return Sifted(capture, session, filter_of(args, capture, session, devices))


def shown_findings(
    args: argparse.Namespace,
    capture: Capture,
    session: Session,
    findings: tuple[Finding, ...],
    devices: Devices | None = None,
) -> tuple[Finding, ...]:
    """Findings with a row among their evidence that -Y accepts."""
    if not args.filter:
        return findings
    from sniff.bus.sifting import shown_findings as shown

    return shown(capture, session, filter_of(args, capture, session, devices), findings)


def _evidence(capture: ReadSource, session: Session, devices: Devices) -> dict[int, frozenset[str]]:
    """Codes of the findings that each row is evidence of."""
    from sniff.analysis.judging import Judging

    judging = Judging(session, dissector_for(session), devices)
    with contextlib.suppress(CaptureError):  # who shows the rows says so
        survey(capture, session, judging)
    found: dict[int, frozenset[str]] = {}
    for finding in judging.findings():
        for no in finding.evidence:
            found[no] = found.get(no, frozenset()) | {finding.code}
    return found


class FieldCells:
    """Cells of `-T fields` for names that only filters know: a row's values, with commas between several."""

    def __init__(self, names: Iterable[str], session: Session, devices: Devices) -> None:
        self._begins: dict[int, int] = {}
        scope = Scope(session.started, devices, begin_of=self._begins.get)
        self._expressions = {
            name: field_of(name, dissector_for(session), scope) for name in names if is_of_filters(name)
        }

    def noting(self, wanted: Filter) -> Wanted:
        """The same filter, shown every row of the capture where the time since the row before is asked for."""
        if "frame.time_delta" not in self._expressions:
            return wanted

        def noted(row: Row, transaction: Transaction | None) -> bool:
            self._begins.pop(row.no - 2, None)
            self._begins[row.no] = row.event.start
            return wanted(row, transaction)

        return noted

    def __contains__(self, name: object) -> bool:
        return name in self._expressions

    def __bool__(self) -> bool:
        return bool(self._expressions)

    def cell(self, name: str, row: Row, transaction: Transaction | None) -> str:
        """What a row has of a name."""
        field = self._expressions[name]
        return ",".join(_cell(value, field.type) for value in field.get(row, transaction))


def is_of_filters(name: str) -> bool:
    """Whether rows of `--json` and fields of dissectors do not have that name, and filters have it."""
    from sniff.bus.row_words import JSON_KEYS

    if name in ("frame.number", "frame.len"):
        return False
    return name not in JSON_KEYS and name not in _OF_ROWS and (name in COLUMN_TYPES or name in ALIASES)


_OF_ROWS = frozenset(
    f"tx.{name}" for name in ("id", "verdict", "attempt", "latency_ms", "latency_low_ms", "latency_high_ms")
)
"""Names under `tx.` that rows have by themselves."""


def _cell(value: object, type: FieldType) -> str:
    from sniff.bus.row_words import iso

    if isinstance(value, bytes):
        return value.hex()
    if type.kind is Kind.TIME and isinstance(value, int):
        return iso(value)
    if type.kind is Kind.DURATION and isinstance(value, int | float):
        return f"{value / (MS if type.unit == 'ms' else NS_PER_S):.9f}".rstrip("0").rstrip(".")
    return str(safe_cell(value)) if isinstance(value, str) else str(value)


def check_names(names: Iterable[str]) -> None:
    """Whether there are such fields; ends with exit code 2 where there is none."""
    from sniff.bus.row_words import JSON_KEYS

    for name in names:
        if name in JSON_KEYS or name in COLUMN_TYPES or name in ALIASES:
            continue
        silent = tuple(prefix for one in registry.usable() if not types_of(one) for prefix in one.prefixes)
        known = [field for one in registry.usable() for field in types_of(one)]
        if name not in known and not (silent and name.startswith(silent)):
            hint = nearest(name, [*JSON_KEYS, *COLUMN_TYPES, *ALIASES, *known])
            raise Failure(f"-e {name}: unknown field ({hint}); --help-fields lists them", USAGE)


class _HelpFields(argparse.Action):
    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        try:
            protocols = [registry.get(values)] if values else list(registry.usable())
        except registry.UnknownProtocol as error:
            raise Failure(str(error), USAGE) from None
        for line in field_lines(protocols):
            print(line)
        parser.exit()


def field_lines(protocols: list[Dissector]) -> Iterable[str]:
    """Every field: its name, its type, what it says and its words."""
    yield "of every protocol"
    for name in COLUMN_TYPES:
        yield from _lines(name, column_type(name, protocols[0]))
    for name, type in POINT_TYPES.items():
        yield from _lines(name, type)
    yield f"  {'output-frequency, …':<36} points by the names that profiles give them (-d STATION=PROFILE)"
    for alias, name in ALIASES.items():
        yield f"  {alias:<36} = {name}"
    for one in protocols:
        yield ""
        yield f"{one.name}"
        types = types_of(one)
        if not types:
            yield f"  fields begin with {', '.join(one.prefixes)}; their types are not declared"
        for name, type in types.items():
            if name not in COLUMN_TYPES:
                yield from _lines(name, type)


def _lines(name: str, type: FieldType) -> Iterable[str]:
    unit = f" ({type.unit})" if type.kind is Kind.DURATION else ""
    span = f"{type.least} … {type.most}" if type.most is not None and not type.words else ""
    says = "never there" if type.never else ", ".join(one for one in (type.says, span) if one)
    says = f"  {says}" if says else ""
    yield f"  {name:<36} {type.kind.value + unit:<13}{says}".rstrip()
    if type.words:
        words = [word if value == word else f"{word} ({value})" for word, value in type.words.items()]
        more = f", … {len(words)} in all" if len(words) > MOST_WORDS else ""
        yield f"  {'':<36}   {', '.join(words[:MOST_WORDS])}{more}"
