"""pytest in a process of its own, for tests of what comes with us for it."""

from __future__ import annotations

import sys

UNUSED = ("cacheprovider", "benchmark", "xdist", "anyio")
HYPOTHESIS = "hypothesispytest"


def pytest_command(*arguments: object, hypothesis: bool = False) -> list[str]:
    """Without the plugins of other packages: importing them took more than half of each run."""
    left_out = UNUSED if hypothesis else (*UNUSED, HYPOTHESIS)
    options = [*(f"-pno:{name}" for name in left_out), "-Wignore::pytest.PytestAssertRewriteWarning"]
    return [sys.executable, "-m", "pytest", "-q", *options, *map(str, arguments)]  # ours is imported by then
