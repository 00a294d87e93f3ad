"""Names of fields: those of `-T fields`, with what rows have of them, and the list of all (`--help-fields`)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from dissectors import registry
from dissectors.field_types import FieldType, Kind
from dissectors.line import MS, NS_PER_S
from dissectors.manifest import Dissector
from dissectors.profiles import Devices
from dissectors.tracker import Transaction
from dissectors.words import exact_duration
from sniff.bus.row_words import JSON_KEYS, iso
from sniff.cli import USAGE, Failure
from sniff.cli.tables import safe_cell
from sniff.engine.engine import Row
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Session
from sniff.engine.verdict_join import Wanted
from sniff.filter import Scope
from sniff.filter.compiling import field_of
from sniff.filter.errors import nearest
from sniff.filter.fields import ALIASES, COLUMN_TYPES, column_type, types_of
from sniff.filter.told import TYPES as POINT_TYPES

MOST_WORDS = 12
"""Words of a field that a list names."""


class FieldCells:
    """Cells of `-T fields` for names that only filters know: a row's values, with commas between several. `findings`:
    codes by the numbers of the rows that show them, where those are asked for."""

    def __init__(
        self,
        names: Iterable[str],
        session: Session,
        devices: Devices,
        findings: Mapping[int, frozenset[str]] | None = None,
    ) -> None:
        self._begins: dict[int, int] = {}
        scope = Scope(
            session.started, devices, begin_of=self._begins.get, findings=findings, has_times=session.has_times
        )
        self._expressions = {
            name: field_of(name, dissector_for(session), scope) for name in names if is_of_filters(name)
        }

    def noting(self, wanted: Wanted | None) -> Wanted | None:
        """The same filter, shown every row of the capture where the time since the row before is asked for."""
        if "frame.time_delta" not in self._expressions:
            return wanted

        def noted(row: Row, transaction: Transaction | None) -> bool:
            self._begins.pop(row.no - 2, None)
            self._begins[row.no] = row.event.start
            return wanted is None or wanted(row, transaction)

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
    if name in ("frame.number", "frame.len"):
        return False
    return name not in JSON_KEYS and name not in _OF_ROWS and (name in COLUMN_TYPES or name in ALIASES)


_OF_ROWS = frozenset(
    f"tx.{name}" for name in ("id", "verdict", "attempt", "latency_ms", "latency_low_ms", "latency_high_ms")
)
"""Names under `tx.` that rows have by themselves."""


def _cell(value: object, type: FieldType) -> str:
    if isinstance(value, bytes):
        return value.hex()
    if type.kind is Kind.TIME and isinstance(value, int):
        return iso(value)
    if type.kind is Kind.DURATION and isinstance(value, int | float):
        return exact_duration(value, MS if type.unit == "ms" else NS_PER_S)
    return str(safe_cell(value)) if isinstance(value, str) else str(value)


def check_names(names: Iterable[str]) -> None:
    """Whether there are such fields; ends with exit code 2 where there is none."""
    for name in names:
        if name == "source" or name in JSON_KEYS or name in COLUMN_TYPES or name in ALIASES:
            continue
        if name in POINT_TYPES:
            raise Failure(f"-e {name}: a row may have many; it is for filters (-Y), and `points` lists values", USAGE)
        protocols = (*registry.usable(), *registry.relatives())
        silent = tuple(prefix for one in protocols if not types_of(one) for prefix in one.prefixes)
        known = [field for one in protocols for field in types_of(one)]
        if name not in known and not (silent and name.startswith(silent)):
            hint = nearest(name, [*JSON_KEYS, *COLUMN_TYPES, *ALIASES, *known])
            raise Failure(f"-e {name}: unknown field ({hint}); --help-fields lists them", USAGE)


def field_lines(protocols: list[Dissector]) -> Iterable[str]:
    """Every field: its name, its type, what it says and its words. Of a relative on networks, behind others: what none
    of them has.
    """
    listed: set[str] = set()
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
            if name not in COLUMN_TYPES and not (name in listed and one.name in registry.RELATIVES):
                yield from _lines(name, type)
        listed |= set(types)


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
