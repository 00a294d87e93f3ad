"""The profiles that come with the package: their documents are package data, read like a module is imported."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

from dissectors.profiles.checked import ProfileError
from dissectors.profiles.gsd import is_gsd, parse_gsd
from dissectors.profiles.model import Profile
from dissectors.profiles.parsing import parse

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

SUFFIX = ".toml"
SAME = "same-as"
"""Key of a document that says only what it has otherwise than a packaged one."""


def names() -> tuple[str, ...]:
    """Names of the packaged profiles, ascending."""
    found = (item.name for item in _folder().iterdir() if item.name.endswith(SUFFIX))
    return tuple(sorted(name.removesuffix(SUFFIX) for name in found))


def _folder() -> Traversable:
    from importlib.resources import files  # and tomllib below: of no use to whoever has no profile

    return files("dissectors.profiles")


@cache
def packaged(name: str) -> Profile:
    """A packaged profile. Raises LookupError for no such name, ProfileError for a broken document."""
    if name not in names():
        raise LookupError(f"no packaged profile {name!r}; there are {', '.join(names())}")
    return parse_text(_text(name), name + SUFFIX)


def _text(name: str) -> str:
    return _folder().joinpath(name + SUFFIX).read_text(encoding="utf-8")


def parse_text(text: str, origin: str) -> Profile:
    """The profile in the text of a TOML document, or of a GSD file. Raises ProfileError."""
    if is_gsd(text):
        return replace(parse_gsd(text, origin), document=text)
    data = _loaded(text, origin)
    if SAME in data:
        data = _over(_base(data.pop(SAME), origin), data)
    return replace(parse(data, origin), document=text)


def _loaded(text: str, origin: str) -> dict[str, Any]:
    import tomllib

    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # no TOML, or a number of more digits than Python reads
        raise ProfileError(f"{origin}: {error}") from None


def _base(name: Any, origin: str) -> dict[str, Any]:
    """The document of the packaged profile that another one speaks of, which stands by itself."""
    data = _loaded(_text(name), name + SUFFIX) if name in names() else None
    if data is None or SAME in data:
        raise ProfileError(f"{origin}: {SAME}: {name!r} is no packaged profile that stands by itself")
    return data


def _over(base: dict[str, Any], said: dict[str, Any]) -> dict[str, Any]:
    """A document with what another says otherwise: keys of it and of its tables, each as a whole."""
    inner = {
        key: {**base[key], **value}
        for key, value in said.items()
        if isinstance(value, dict) and isinstance(base.get(key), dict)
    }
    return {**base, **said, **inner}
