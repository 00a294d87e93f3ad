"""The captures that are served, by names that are asked for; nothing else can be read."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from sniff.assistant.asking import Refused


class Captures:
    """Names → paths. A name is the file's; where several are called alike, as many folders as tell them apart."""

    def __init__(self, paths: Iterable[str]) -> None:
        found = list(dict.fromkeys(Path(path).absolute() for path in paths))
        self._paths = {_name(path, found): path for path in found}

    @property
    def names(self) -> list[str]:
        """All of them."""
        return list(self._paths)

    def path(self, name: str) -> str:
        """Where a capture is; with one capture it need not be named. Raises `Refused`."""
        if not name and len(self._paths) == 1:
            return str(next(iter(self._paths.values())))
        if name not in self._paths:
            raise Refused(f"no capture is called {name[:80]!r}; there are: {', '.join(self._paths)}")
        return str(self._paths[name])


def _name(path: Path, among: list[Path]) -> str:
    for depth in range(1, len(path.parts)):
        last = path.parts[-depth:]
        if sum(other.parts[-depth:] == last for other in among) == 1:
            return "/".join(last)
    return str(path)
