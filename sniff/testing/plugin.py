"""The pytest plugin: captures beside their expectations become tests; fixtures for captures, buses and frames.

Loading it costs nothing: the rest of the program is imported when a capture is met.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dissectors import registry

if TYPE_CHECKING:
    from sniff.simulation.bus import VirtualBus
    from sniff.testing.capture_reading import CaptureReading

INI = "sniff_captures"
WITHOUT = pytest.StashKey[dict[Path, None]]()
"""Captures that were met and are no test, for nobody has written what is expected of them."""
NAMED = 3
"""So many of them are named."""

pytest.register_assert_rewrite("sniff.testing.framer_contract")  # imports nothing: its failures will show their values


def pytest_addoption(parser: pytest.Parser) -> None:
    """--sniff-update, --sniff-strict, and where captures are."""
    group = parser.getgroup("sniff485", "captures as tests")
    group.addoption("--sniff-update", action="store_true", help="write the expectations of captures")
    group.addoption("--sniff-strict", action="store_true", help="a capture without an expectation is an error")
    parser.addini(INI, "folders whose captures are tests", type="paths", default=[])


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A capture in one of the configured folders."""
    from sniff.testing.naming import expectation_path, is_capture

    folders = parent.config.getini(INI)
    if not is_capture(file_path) or not any(file_path.is_relative_to(folder) for folder in folders):
        return None
    wanted = parent.config.getoption("--sniff-update") or parent.config.getoption("--sniff-strict")
    if not wanted and not expectation_path(file_path).exists():
        parent.config.stash.setdefault(WITHOUT, {})[file_path] = None
        return None
    collector: pytest.Collector = CaptureFile.from_parent(parent, path=file_path)
    return collector


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say which captures are not tested."""
    paths = [*config.stash.get(WITHOUT, {})]
    if not paths:
        return
    shown = [str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path) for path in paths[:NAMED]]
    more = f" and {len(paths) - NAMED} more" if len(paths) > NAMED else ""
    many = "1 capture" if len(paths) == 1 else f"{len(paths)} captures"
    terminalreporter.write_line(f"{many} without expectation: sniff485 snapshot {' '.join(shown)}{more} writes it")


class CaptureFile(pytest.File):
    """One capture."""

    def collect(self) -> Iterable[pytest.Item]:
        """One test: the reading is as expected."""
        yield CaptureItem.from_parent(self, name="reading")


class CaptureItem(pytest.Item):
    """A capture reads as its expectation says."""

    def runtest(self) -> None:
        """Compare, or write with --sniff-update."""
        from sniff.testing import expectation_path, read_capture, render
        from sniff.testing.expectation import difference

        found = render(read_capture(self.path))
        place = expectation_path(self.path)
        if self.config.getoption("--sniff-update"):
            if not place.exists() or place.read_text(encoding="utf-8") != found:
                place.write_text(found, encoding="utf-8")
            return
        if not place.exists():
            raise CaptureDiffers(f"{self.path}: no expectation; write it with --sniff-update, and read it")
        said = difference(place.read_text(encoding="utf-8"), found, place.name)
        if said:
            raise CaptureDiffers(said)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The diff and nothing else; of what cannot be read, why."""
        from sniff.engine.capture import CaptureError

        if isinstance(excinfo.value, CaptureDiffers):
            return f"{excinfo.value}\n(accept it with: pytest --sniff-update {self.path})"
        if isinstance(excinfo.value, CaptureError):
            return str(excinfo.value)
        if isinstance(excinfo.value, registry.UnknownProtocol):
            return f"{self.path}: {excinfo.value}"
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where this test is from."""
        return self.path, None, f"capture {self.path.name}"


class CaptureDiffers(AssertionError):
    """A capture does not read as expected; the message is a unified diff."""


@pytest.fixture
def capture(request: pytest.FixtureRequest) -> Callable[[str], CaptureReading]:
    """`capture("poll")` reads a capture of the configured folders (or beside the test) whole."""

    def find(name: str) -> CaptureReading:
        from sniff.testing import read_capture
        from sniff.testing.naming import CAPTURE_SUFFIXES, is_capture

        folders = [request.path.parent, *request.config.getini(INI)]
        for folder in folders:
            for path in [folder / name, *(folder / f"{name}{suffix}" for suffix in CAPTURE_SUFFIXES)]:
                if path.is_file():
                    return read_capture(path)
        there = sorted(
            {path.name for folder in folders if folder.is_dir() for path in folder.iterdir() if is_capture(path)}
        )
        known = f"; there are {', '.join(there)}" if there else ""
        raise FileNotFoundError(f"capture {name!r}: in none of {', '.join(map(str, folders))}{known}")

    return find


@pytest.fixture
def virtual_bus() -> Iterator[Callable[..., VirtualBus]]:
    """`virtual_bus(NAME, faults=False)` runs a simulated bus; its ports are pseudo-terminals.

    Arguments as for `sniff.simulation.scenarios.scenario`. Closed at the end of the test.
    """
    from contextlib import ExitStack

    with ExitStack() as stack:

        def make(name: str = registry.DEFAULT, **options: Any) -> VirtualBus:
            from sniff.simulation.bus import VirtualBus
            from sniff.simulation.scenarios import scenario

            return stack.enter_context(VirtualBus.from_scenario(scenario(name, **options)))

        yield make


@pytest.fixture
def replay() -> Iterator[Callable[..., str]]:
    """`replay(path, speed=10.0)` plays a capture to a new pseudo-terminal; gives the path to open for reading.

    It begins when the other side has opened it. For tests of software that listens to a bus.
    """
    from contextlib import ExitStack

    with ExitStack() as stack:

        def play(path: str | Path, speed: float = 1.0) -> str:
            from sniff.simulation.replaying import PtyReplay

            return stack.enter_context(PtyReplay(Path(path), speed)).port

        yield play


@pytest.fixture
def craft() -> Callable[..., bytes]:
    """`craft(KIND, unit=1, pdu=bytes.fromhex("030000 0002"))`: a whole frame with its check."""
    from sniff.testing.crafting import craft as make

    return make
