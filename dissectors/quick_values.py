"""Quick values: frozen dataclasses that are made by the million, made three times as fast.

A frozen dataclass sets each of its fields by `object.__setattr__`, since its own refuses; with fourteen fields that is
most of what a frame costs. Here a value is open while it is made, and closed before anybody sees it.
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any, TypeVar

_Value = TypeVar("_Value")


def quickly_made(value: type[_Value]) -> type[_Value]:
    """A frozen, slotted dataclass with an `__init__` that does the same in less time.

    Raises TypeError for one that is not slotted, that inherits, or whose `__init__` does more than set what it is
    given or the plain defaults.
    """
    named: Any = value
    parts = fields(named)
    plain = all(part.default_factory is MISSING and part.init and not part.kw_only for part in parts)
    names = tuple(part.name for part in parts)
    if not plain or hasattr(value, "__post_init__") or value.__bases__ != (object,):
        raise TypeError(f"{value.__name__} is more than its fields")
    if getattr(value, "__slots__", None) != names or not named.__dataclass_params__.frozen:
        raise TypeError(f"{value.__name__} is not frozen and slotted")
    made = value.__init__
    space: dict[str, Any] = {"_set": object.__setattr__, "_open": _opened(names), "_closed": value, "_made": made}
    body = "".join(f"    self.{name} = {name}\n" for name in names)
    exec(
        f"def __init__(self, {', '.join(names)}):\n"
        f"    if self.__class__ is not _closed:\n        return _made(self, {', '.join(names)})\n"  # an heir stays one
        f"    _set(self, '__class__', _open)\n{body}    self.__class__ = _closed\n",
        space,
    )
    quick = space["__init__"]
    quick.__defaults__, quick.__annotations__ = made.__defaults__, made.__annotations__
    quick.__qualname__, quick.__module__ = made.__qualname__, value.__module__
    named.__init__ = quick
    return value


def _opened(names: tuple[str, ...]) -> type:
    """A class whose instances are laid out alike and can be set."""
    return type("_Open", (), {"__slots__": names})
