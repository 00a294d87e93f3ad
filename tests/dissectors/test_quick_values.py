"""Values that are made quickly are the same values."""

from __future__ import annotations

import pickle
from dataclasses import FrozenInstanceError, dataclass, field, fields, replace

import pytest

from dissectors.frame import Check, FoundBy, Frame, Role
from dissectors.plugin_guard import FailedHeader
from dissectors.quick_values import quickly_made


@dataclass(frozen=True, slots=True)
class Plain:
    first: int
    second: str = "two"
    third: tuple[int, ...] = ()


@quickly_made
@dataclass(frozen=True, slots=True)
class Quick:
    first: int
    second: str = "two"
    third: tuple[int, ...] = ()


def test_it_is_made_like_a_plain_one() -> None:
    for given, named in (((1,), {}), ((1, "x"), {}), ((1,), {"third": (3,)}), ((), {"second": "y", "first": 2})):
        plain, quick = Plain(*given, **named), Quick(*given, **named)  # type: ignore[arg-type]
        assert repr(quick) == repr(plain).replace("Plain", "Quick")
        assert hash(quick) == hash(plain)
        assert quick == Quick(plain.first, plain.second, plain.third)
        assert type(quick) is Quick
    with pytest.raises(TypeError, match="first"):
        Quick()  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="fourth"):
        Quick(1, fourth=4)  # type: ignore[call-arg]


def test_an_heir_stays_one() -> None:
    class Bare(Quick):
        __slots__ = ()

    @dataclass(frozen=True, slots=True)
    class Longer(Quick):
        fourth: int = 4

    assert [type(one) for one in (Bare(1), Longer(1), FailedHeader("x", None, None, Role.UNKNOWN, "x"))] == [
        Bare, Longer, FailedHeader,
    ]  # fmt: skip
    assert (Bare(1, third=(3,)).third, Longer(1, fourth=5).fourth) == ((3,), 5)


def test_nobody_changes_it_afterwards() -> None:
    quick = Quick(1)
    with pytest.raises(FrozenInstanceError):
        quick.first = 2  # type: ignore[misc]
    with pytest.raises((AttributeError, TypeError)):
        quick.other = 2  # type: ignore[attr-defined]
    assert not hasattr(quick, "__dict__")


def test_it_is_copied_and_pickled() -> None:
    frame = Frame("x", b"\1", 1, 2, Check.GOOD, FoundBy.GAP)
    assert pickle.loads(pickle.dumps(frame)) == frame
    assert replace(frame, end=3).end == 3
    assert [part.name for part in fields(frame)][:2] == ["protocol", "octets"]


def test_what_does_more_than_keep_its_fields_is_refused() -> None:
    @dataclass(frozen=True, slots=True)
    class Listing:
        items: list[int] = field(default_factory=list)

    @dataclass(slots=True)
    class Open:
        item: int

    @dataclass(frozen=True)
    class Loose:
        item: int

    @dataclass(frozen=True, slots=True)
    class Heir(Plain):
        fourth: int = 4

    @dataclass(frozen=True, slots=True)
    class Checked:
        item: int

        def __post_init__(self) -> None:
            assert self.item

    for unfit in (Listing, Open, Loose, Heir, Checked):
        with pytest.raises(TypeError, match=unfit.__name__):
            quickly_made(unfit)
