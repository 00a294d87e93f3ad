"""pytest in a process of its own, for tests of what comes with us for it."""

from __future__ import annotations

import sys

UNUSED = ("cacheprovider", "benchmark", "xdist", "anyio")
HYPOTHESIS = "hypothesispytest"


def pytest_command(*arguments: object, hypothesis: bool = False) -> list[str]:
    """Without the plugins of other packages: importing them took more than half of each run."""
    left_out = UNUSED if hypothesis else (*UNUSED, HYPOTHESIS)
    return [sys.executable, "-m", "pytest", "-q", *(f"-pno:{name}" for name in left_out), *map(str, arguments)]
