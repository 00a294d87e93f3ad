"""Exchanges of an MS/TP bus that tell nothing for sure: those of frames without data."""

from __future__ import annotations

from dissectors.bacnet.frame_types import HEADER
from dissectors.columns import FrameColumns, Masks, Octets
from dissectors.reading_columns import ReadingColumns


def reading_columns(asked: FrameColumns, answered: FrameColumns, has_answer: Masks, octets: Octets) -> ReadingColumns:
    """See `dissectors.reading_columns.BulkReadings`; what carries data is for `readings.py`."""
    return ReadingColumns.nothing(asked.length <= HEADER)
