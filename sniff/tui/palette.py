"""The command palette: every action that has a key here, every screen, the themes."""

from __future__ import annotations

from functools import partial
from typing import Any

from textual.command import DiscoveryHit, Hit, Hits, Provider

from sniff.tui.keybar import explanation, working_keys


class ActionCommands(Provider):
    """Lists what the keys of the screen below the palette do."""

    def _actions(self) -> list[tuple[str, str, partial[Any]]]:
        found = []
        for key, active in working_keys(self.screen):
            run = partial(self.app.run_action, active.binding.action, active.node)
            found.append((explanation(active), f"key {key}", run))
        return found

    async def discover(self) -> Hits:
        """Everything, before a word was typed."""
        for title, help_text, run in self._actions():
            yield DiscoveryHit(title, run, help=help_text)

    async def search(self, query: str) -> Hits:
        """What matches the words typed."""
        matcher = self.matcher(query)
        for title, help_text, run in self._actions():
            score = matcher.match(title)
            if score > 0:
                yield Hit(score, matcher.highlight(title), run, help=help_text)
