"""A TOML table read key by key: what is wrong is said with file and key, and what nobody asked for is an error."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

MOST = 1e300
_MOST_NUMBERS = 65536
"""No larger number, and no more numbers in a list, than anything of a device can need."""


class ProfileError(ValueError):
    """A profile that cannot be used; the message names file, key and what was expected."""


class CheckedTable:
    """One table of a document. `path`: where it is ("modbus.register[3]"), empty for the document itself."""

    def __init__(self, origin: str, path: str, data: Mapping[str, Any]) -> None:
        self.origin = origin
        self.path = path
        self.data = data
        self._asked: set[str] = set()

    def error(self, key: str, what: str) -> ProfileError:
        """An error about a key of this table."""
        return ProfileError(f"{self.origin}: {'.'.join(part for part in (self.path, key) if part)}: {what}")

    def __contains__(self, key: str) -> bool:
        self._asked.add(key)
        return key in self.data

    def text(self, key: str, default: str | None = None) -> str:
        """A text; without default it must be there."""
        return self.spoken(key, self._value(key, default))

    def whole(self, key: str, default: int | None = None) -> int:
        """A whole number."""
        value = self._value(key, default)
        if not isinstance(value, int) or isinstance(value, bool):
            raise self.error(key, f"expected a whole number, not {value!r}")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """A number."""
        value = self._value(key, default)
        if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) < MOST:
            raise self.error(key, f"expected a number, not {value!r}")
        return float(value)

    def flag(self, key: str) -> bool:
        """true or false; false when absent."""
        value = self._value(key, False)
        if not isinstance(value, bool):
            raise self.error(key, f"expected true or false, not {value!r}")
        return value

    def choice(self, key: str, known: Iterable[str], default: str) -> str:
        """The text under a key, one of the words that are known there."""
        value, words = self.text(key, default), tuple(known)
        if value not in words:
            raise self.error(key, f"{value!r}: expected one of {', '.join(words)}")
        return value

    def texts(self, key: str, default: tuple[str, ...] | None = None) -> tuple[str, ...]:
        """A list of texts."""
        value = self._value(key, list(default) if default is not None else None)
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.error(key, f"expected a list of texts, not {value!r}")
        return tuple(self.spoken(key, item) for item in value)

    def pair(self, key: str) -> tuple[float, float] | tuple[None, None]:
        """A range as [low, high]; Nones when absent."""
        value = self._value(key, ())
        if value == ():
            return None, None
        good = isinstance(value, list) and len(value) == 2 and all(type(item) in (int, float) for item in value)
        if not good or not -MOST < value[0] <= value[1] < MOST:
            raise self.error(key, f"expected [low, high], not {value!r}")
        return float(value[0]), float(value[1])

    def numbered(self, key: str) -> dict[int, Any]:
        """A table whose keys are whole numbers, decimal or 0x…; empty when absent."""
        found: dict[int, Any] = {}
        for word, value in self.table(key).data.items():
            try:
                number = int(word, 0) if word.startswith("0x") else int(word)
            except ValueError:
                raise self.error(f"{key}.{word}", "expected a number as key") from None
            if number in found:
                raise self.error(f"{key}.{word}", "is there twice")
            found[number] = value
        return found

    def tables_by_number(self, key: str) -> dict[int, CheckedTable]:
        """A table of tables by number; empty when absent."""
        found = {}
        for number, value in self.numbered(key).items():
            if not isinstance(value, dict):
                raise self.error(f"{key}.{number}", f"expected a table, not {value!r}")
            found[number] = CheckedTable(self.origin, f"{self.path}.{key}.{number}", value)
        return found

    def with_usual(self, **values: Any) -> CheckedTable:
        """The same table with values for keys that it does not have."""
        return CheckedTable(self.origin, self.path, {**values, **self.data})

    def words(self, key: str) -> dict[int, str]:
        """A table of texts by number; empty when absent."""
        table = self.table(key)
        return {number: table.spoken(str(number), words) for number, words in self.numbered(key).items()}

    def spoken(self, key: str, value: Any) -> str:
        """A text that may be shown to people."""
        if not isinstance(value, str):
            raise self.error(key, f"expected a text in quotes, not {value!r}")
        if any(not character.isprintable() for character in value):
            raise self.error(key, "has a control character")
        return value

    def numbers(self, key: str) -> tuple[int, ...]:
        """Numbers as "0-19 26 27"; empty when absent."""
        found: list[int] = []
        for word in self.text(key, "").split():
            first, dash, last = word.partition("-")
            try:
                span = range(int(first), int(last if dash else first) + 1)
            except ValueError:
                span = range(0)
            if not span:
                raise self.error(key, f"{word!r}: expected numbers and spans, for instance 0-19 26")
            found.extend(span[:_MOST_NUMBERS])
            if len(found) > _MOST_NUMBERS:
                raise self.error(key, f"expected at most {_MOST_NUMBERS} numbers")
        if len(set(found)) != len(found):
            raise self.error(key, "has a number twice")
        return tuple(found)

    def table(self, key: str) -> CheckedTable:
        """A table in this one, empty when absent."""
        value = self._value(key, {})
        if not isinstance(value, dict):
            raise self.error(key, f"expected a table, not {value!r}")
        return CheckedTable(self.origin, f"{self.path}.{key}" if self.path else key, value)

    def tables(self, key: str) -> Iterator[CheckedTable]:
        """The tables of an array [[key]]."""
        value = self._value(key, [])
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise self.error(key, f"expected tables [[{key}]]")
        prefix = f"{self.path}.{key}" if self.path else key
        for number, item in enumerate(value, 1):
            yield CheckedTable(self.origin, f"{prefix}[{number}]", item)

    def finish(self) -> None:
        """Complain of the first key that nobody asked for."""
        for key in self.data:
            if key not in self._asked:
                import difflib  # for who made a mistake

                close = difflib.get_close_matches(key, self._asked, 1, 0.5)
                hint = f"; did you mean {close[0]!r}?" if close else f"; known: {', '.join(sorted(self._asked))}"
                raise self.error(key, f"unknown key{hint}")

    def _value(self, key: str, default: Any) -> Any:
        self._asked.add(key)
        value = self.data.get(key, default)
        if value is None:
            raise self.error(key, "is missing")
        return value
