"""What other packages bring, by entry point. Nothing is imported for it before somebody asks: the metadata of packages
and what reads them cost a short command a tenth of its time."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoints


def entry_points(group: str) -> EntryPoints:
    """The entry points of a group, of every installed package."""
    from importlib import metadata

    return metadata.entry_points(group=group)
