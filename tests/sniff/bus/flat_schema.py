"""What a JSON schema must be for Foxglove and PlotJuggler to plot it without a plug-in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SCALARS = {"number", "integer", "string", "boolean"}


def faults(schema: Mapping[str, Any]) -> list[str]:
    """What is wrong with a schema: not an object at its root, a property that is no single scalar, references."""
    found = [] if schema.get("type") == "object" else ["the root is no object"]
    for name, entry in schema.get("properties", {}).items():
        if not isinstance(entry.get("type"), str) or entry["type"] not in SCALARS:
            found.append(f"{name}: type {entry.get('type')!r}")
    text = str(schema)
    return found + [word for word in ("$ref", "anyOf", "oneOf", "allOf", "null", "$defs") if f"'{word}'" in text]


def misfits(schema: Mapping[str, Any], value: Mapping[str, Any]) -> list[str]:
    """What in a message does not fit its schema."""
    types = {"number": (int, float), "integer": int, "string": str, "boolean": bool}
    found = [f"{name} is missing" for name in schema.get("required", ()) if name not in value]
    for name, held in value.items():
        kind = schema["properties"].get(name, {}).get("type")
        if kind is None:
            found.append(f"{name} is not in the schema")
        elif not isinstance(held, types[kind]) or (isinstance(held, bool) and kind != "boolean"):
            found.append(f"{name}: {held!r} is no {kind}")
    return found
