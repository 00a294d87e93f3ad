"""JSON that every reader takes: sensors send numbers that it has none for."""

from __future__ import annotations

import json

import pytest

from sniff.analysis.json_text import dumps


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ({"fields": {"bacapp.present_value.real": float("nan")}}, '{"fields": {"bacapp.present_value.real": "nan"}}'),
        ([1.5, float("inf"), (float("-inf"), "NaN")], '[1.5, "inf", ["-inf", "NaN"]]'),
    ],
)
def test_a_number_that_json_has_none_for_is_a_text(value: object, text: str) -> None:
    assert dumps(value) == text
    assert json.loads(dumps(value), parse_constant=pytest.fail)
