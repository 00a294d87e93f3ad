"""A sample as a row of typed cells, for Parquet files and data frames."""

from __future__ import annotations

from sniff.analysis.point_reader import Sample
from sniff.formats.parquet import Kind

COLUMNS = {
    "time": Kind.TIME,
    "device": Kind.TEXT,
    "point": Kind.TEXT,
    "value": Kind.NUMBER,
    "text": Kind.TEXT,
    "raw": Kind.INTEGER,
    "unit": Kind.TEXT,
    "quality": Kind.INTEGER,
    "how": Kind.TEXT,
    "frame": Kind.INTEGER,
    "means": Kind.TEXT,
}
"""In the order of the cells."""

Cell = str | int | float | None


def sample_row(sample: Sample) -> tuple[Cell, ...]:
    """A column has one type: a number and a text do not share one."""
    value = sample.value
    shown = shown_value(sample)
    text = isinstance(value.value, str)
    number = None if text else float(value.value)
    return (
        sample.time,
        sample.station,
        sample.name,
        number,
        shown if text else None,
        value.raw,
        value.unit,
        int(value.quality),
        value.how.value,
        sample.frame,
        value.words,
    )


def shown_value(sample: Sample) -> Cell:
    """The value; text from the wire without its control characters, no number as text."""
    value = sample.value.value
    if isinstance(value, str):
        return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in value)
    return value if sample.finite else str(value)
