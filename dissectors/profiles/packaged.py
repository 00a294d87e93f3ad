"""The profiles that come with the package: their documents are package data, read like a module is imported."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

from dissectors.profiles.checked import ProfileError
from dissectors.profiles.gsd import is_gsd, parse_gsd
from dissectors.profiles.model import Profile
from dissectors.profiles.parsing import parse

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

SUFFIX = ".toml"


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
    text = _folder().joinpath(name + SUFFIX).read_text(encoding="utf-8")
    return parse_text(text, name + SUFFIX)


def parse_text(text: str, origin: str) -> Profile:
    """The profile in the text of a TOML document, or of a GSD file. Raises ProfileError."""
    if is_gsd(text):
        return replace(parse_gsd(text, origin), document=text)
    import tomllib

    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise ProfileError(f"{origin}: {error}") from None
    return replace(parse(data, origin), document=text)
