"""Puts manual pages and completion into the wheel; they are made from the command line while it is built."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class GeneratedFiles(BuildHookInterface):  # type: ignore[type-arg]
    """Writes them beside the build, and says where they are to lie below the prefix."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before the wheel is written."""
        sys.path.insert(0, self.root)
        try:
            from docs.generate.completion import completions
            from docs.generate.manual import manual_pages

            made = {f"share/man/man1/{name}": text for name, text in manual_pages().items()} | completions()
        finally:
            sys.path.remove(self.root)
        self._folder = Path(mkdtemp(prefix="sniff485-build-"))
        for place, text in made.items():
            path = self._folder / place
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            build_data["shared_data"][str(path)] = place

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """After it was written."""
        import shutil

        shutil.rmtree(self._folder, ignore_errors=True)
