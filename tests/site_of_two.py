"""A recording of two buses, made of two captures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from dissectors.frame import Chunk
from sniff.formats import read
from sniff.recording.writer import SharedFile


def site_of_two(folder: Path, roof: Path, cellar: Path) -> Path:
    """One file in which they are buses of these names."""
    captures = [read(roof), read(cellar)]
    sessions = [replace(one.session, bus=name) for one, name in zip(captures, ("roof", "cellar"), strict=True)]
    recorders = SharedFile(folder / "site.mcap", sessions).recorders()
    for recorder, capture in zip(recorders, captures, strict=True):
        for item in capture.items():
            assert isinstance(item, Chunk)
            recorder.chunk(item)
    for recorder in recorders:
        recorder.finish()
    for recorder in recorders:
        recorder.close()
    return folder / "site.mcap"
