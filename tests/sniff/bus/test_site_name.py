"""Which recording a capture's name is of."""

from __future__ import annotations

import pytest

from sniff.bus.site import site_name


@pytest.mark.parametrize(
    ("source", "site"),
    [
        ("site.mcap [boiler]", "site.mcap"),
        ("site.mcap", "site.mcap"),
        ("site-0001.mcap [boiler] and 4 more parts", "site-0001.mcap"),
        ("night [1].mcap", "night [1].mcap"),
        ("night [1].mcap [roof 2]", "night [1].mcap"),
        ("night-0001.mcap and 4 more parts", "night-0001.mcap and 4 more parts"),
        ("plant [2]/a.mcap", "plant [2]/a.mcap"),  # not the same as plant [2]/b.mcap
        ("plant [2]/a.mcap [boiler]", "plant [2]/a.mcap"),
        ("v1.0 [x]/a.mcap.gz [boiler]", "v1.0 [x]/a.mcap.gz"),
        ("night [2].mcap", "night [2].mcap"),
        ("night.mcap [a.b [c]]", "night.mcap"),
        ("night.mcap [a/b]", "night.mcap"),
        ("night [boiler]", "night"),
    ],
)
def test_the_recording_of_a_bus(source: str, site: str) -> None:
    assert site_name(source) == site
