"""Captures as tests: a pytest plugin, and what it is made of.

    *.cap.txt, *.mcap, *.pcap, *.pcapng, x.log  beside  *.expect.txt, x.log.expect.txt  →  one test each

Point pytest at the folders that hold captures:

    [tool.pytest.ini_options]
    sniff_captures = ["captures"]

`pytest --sniff-update` writes the expectations (review the diff), `--sniff-strict` fails on captures without one.
Fixtures: `capture("name")`, `virtual_bus`, `replay`, `craft`; see `sniff.testing.plugin`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sniff.testing.naming import EXPECT_SUFFIX, expectation_path

if TYPE_CHECKING:
    from sniff.testing.capture_reading import CaptureReading, read_capture
    from sniff.testing.crafting import craft
    from sniff.testing.expectation import render

__all__ = ["EXPECT_SUFFIX", "CaptureReading", "craft", "expectation_path", "read_capture", "render"]

_LATER = {
    "CaptureReading": "capture_reading",
    "read_capture": "capture_reading",
    "craft": "crafting",
    "render": "expectation",
}


def __getattr__(name: str) -> Any:  # pytest loads the plugin in every run; the program only where it is used
    from importlib import import_module

    if name not in _LATER:
        raise AttributeError(name)
    return getattr(import_module(f"sniff.testing.{_LATER[name]}"), name)
