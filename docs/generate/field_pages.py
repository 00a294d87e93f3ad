"""Pages of all fields: names for filters and `-T fields`, with their types and words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from dissectors.field_types import FieldType, Kind
from docs.generate.markdown import code, table, told

MOST_WORDS = 40
"""Words of one field that a page names."""


def field_pages() -> Iterator[tuple[str, str]]:
    """Page addresses and their Markdown."""
    from dissectors import registry
    from sniff.filter.fields import ALIASES, COLUMN_TYPES, column_type, types_of

    protocols = [registry.get(name) for name in registry.BUILT_IN]
    common = {name: column_type(name, protocols[0]) for name in COLUMN_TYPES}
    lines = [
        "# Fields",
        "",
        "Names for filters (`-Y`, `/` in the terminal UI) and for `show -T fields -e NAME`. These every frame has; "
        "those of a protocol are on its page.",
        "",
        *_table(common),
        "",
        "Other names for the same:",
        "",
        *table(("name", "is"), [(code(alias), code(name)) for alias, name in ALIASES.items()]),
        "",
        "Fields of protocols:",
        "",
    ]
    for one in protocols:
        own = {name: kind for name, kind in types_of(one).items() if name not in COLUMN_TYPES}
        lines.append(f"- [{one.title}]({one.name}.md): {len(own)} fields")
        page = [f"# Fields: {one.title}", "", *_table(own)]
        yield f"reference/fields/{one.name}.md", "\n".join(page) + "\n"
    yield "reference/fields/index.md", "\n".join(lines) + "\n"


def _table(types: Mapping[str, FieldType]) -> Iterator[str]:
    return table(("name", "type", ""), [(code(name), _kind(kind), _says(kind)) for name, kind in types.items()])


def _kind(type: FieldType) -> str:
    return f"{type.kind.value} ({type.unit})" if type.kind is Kind.DURATION else type.kind.value


def _says(type: FieldType) -> str:
    words = [word if value == word else f"{word} ({value})" for word, value in type.words.items()]
    more = [f"… {len(words)} in all"] if len(words) > MOST_WORDS else []
    said = [told(type.says)] if type.says else []
    if words:
        said.append(told(", ".join(words[:MOST_WORDS] + more)))
    return ": ".join(said)
