"""Values that are offered while a filter is typed: taken as they are, they find the row that has them."""

from __future__ import annotations

import pytest

from dissectors import registry
from sniff.filter.compiling import field_of
from sniff.filter.completion import shown_value
from sniff.filter.literals import value_of
from sniff.filter.syntax import Word


@pytest.mark.parametrize("name", ["latency_ms", "frame.time_relative"])
@pytest.mark.parametrize("time", [0, 500, 12_345_678, 1_234_567_890, 86_400_123_456_789, (1 << 62) + 1])
def test_a_duration_is_offered_with_all_its_digits(name: str, time: int) -> None:
    field = field_of(name, registry.get("modbus-rtu"))
    assert value_of(Word(shown_value(time, field), 0), field.type, name, {}) == (time,)
