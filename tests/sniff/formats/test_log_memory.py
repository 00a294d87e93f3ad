"""What was found in a short line is not looked for again; long ones are not kept."""

from __future__ import annotations

from sniff.formats.log_memory import LONGEST_REMEMBERED, remembered


def test_short_texts_are_gone_through_once_and_long_ones_are_not_kept() -> None:
    asked: list[tuple[str, int]] = []

    @remembered
    def ends(text: str, count: int = 1) -> str:
        asked.append((text, count))
        return text[-count:]

    short, long = "a" * LONGEST_REMEMBERED, "b" * (LONGEST_REMEMBERED + 1)
    for text in (short, long, short, long):
        assert ends(text) == text[-1:]
        assert ends(text, 2) == text[-2:]
    assert asked == [(short, 1), (short, 2), *[(long, 1), (long, 2)] * 2]
