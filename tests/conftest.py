"""Settings of all tests: how many examples hypothesis makes, how many tests run at once, and which begin.

The suite is to run in minutes on two cores and to say the same of the same code each time: its examples are drawn from
the test, not by chance. `HYPOTHESIS_PROFILE=thorough` searches longer, and elsewhere each time. No example has a
deadline: how long one takes depends on what else the machine does.
"""

from __future__ import annotations

import gc
import os
from pathlib import Path

import pytest
from _pytest.runner import runtestprotocol
from hypothesis import HealthCheck, settings

SLOW = [HealthCheck.too_slow]
settings.register_profile("suite", max_examples=12, deadline=None, derandomize=True, suppress_health_check=SLOW)
settings.register_profile("thorough", max_examples=1000, deadline=None, suppress_health_check=SLOW)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "suite"))

os.environ["LANGUAGE"] = "C"
"""Else argparse looks for files of translations at each of its words: 2.6 of the 6.2 ms that a parser takes."""

os.environ["OPENBLAS_NUM_THREADS"] = "1"
"""As the command does it (`sniff/cli`): what numpy multiplies matrices with would start threads in each process."""

os.environ["TEXTUAL_ANIMATIONS"] = "none"
"""What is scrolled to is there at once: nothing is drawn on the way, and no test waits for it."""

gc.disable()
"""While modules are imported and tests are collected, all that is made stays."""

END_TO_END = Path(__file__).parent / "e2e"


@pytest.hookimpl(optionalhook=True)  # there are runs without xdist
def pytest_xdist_auto_num_workers() -> int:
    """One more than there are cores: somebody always waits for a process, a port or a disk."""
    affinity = getattr(os, "sched_getaffinity", None)  # of Linux alone
    return (len(affinity(0)) if affinity else os.cpu_count() or 1) + 1


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Those that wait come first: the others have work for the cores meanwhile, to the end."""
    items.sort(key=lambda item: not item.path.is_relative_to(END_TO_END))


def pytest_collection_finish() -> None:
    """Ten thousand tests with their parameters are no garbage: to go through them again and again took a tenth of the
    suite's time."""
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Of several workers, each says of a test what is worth saying: that it began, which nobody is shown, and three
    reports, two of them that nothing went wrong before and after it, took the suite's processes a third of what they
    cost beside the tests."""
    if not hasattr(item.config, "workerinput"):
        return None
    for report in runtestprotocol(item, log=False, nextitem=nextitem):
        if report.when == "call" or not report.passed:
            item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True
