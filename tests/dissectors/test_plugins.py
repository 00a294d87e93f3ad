"""Plug-ins that cannot be used, or whose functions raise: one line that names them, never a traceback."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dissectors import registry
from sniff.cli import main
from sniff.simulation import scenarios

Command = Callable[..., tuple[int, str, str]]


class Point:
    """An entry point that gives, or raises, what a test wants."""

    def __init__(self, name: str, load: Callable[[], Any]) -> None:
        self.name, self.load, self.value = name, load, f"package_{name}:IT"
        self.dist = SimpleNamespace(name=f"package-{name}")


def fails(*_: object) -> Any:
    raise ValueError("it\x1b[31m broke")


@pytest.fixture
def plug(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    def put(name: str, load: Callable[[], Any]) -> None:
        monkeypatch.setattr(registry, "entry_points", lambda group: [Point(name, load)])

    return put


@pytest.fixture
def show(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    def run(*arguments: str) -> tuple[int, str, str]:
        path = tmp_path / "a.hex"
        path.write_text("01 03 00 00 00 02 C4 0B\n")
        code = main([arguments[0], str(path), *arguments[1:]])
        return code, *capsys.readouterr()

    return run


def missing() -> Any:
    raise ModuleNotFoundError("No module named 'not_there'")


@pytest.mark.parametrize(
    ("load", "why"), [(missing, "No module named 'not_there'"), (lambda: 3, "package_broken:IT is no Dissector")]
)
def test_a_bad_entry_point_is_one_line(plug: Callable[..., None], show: Command, load: Any, why: str) -> None:
    plug("broken", load)
    code, out, err = show("show", "-p", "broken")
    assert (code, out) == (2, "")
    assert err == f"sniff485: plug-in 'broken' of package package-broken: {why}\n"


@pytest.mark.parametrize("function", ["peek", "text", "fields"])
def test_a_function_that_raises_is_said_at_its_row(plug: Callable[..., None], show: Command, function: str) -> None:
    rtu = registry.get("modbus-rtu")
    plug("half", lambda: replace(rtu, name="half", **{function: fails}))
    code, out, _ = show("show", "-p", "half", "--json", "--fields")
    assert code == 0
    assert f"{function} of plug-in 'half' failed: ValueError: it.[31m broke" in out
    code, out, _ = show("show", "-p", "half", "-V")
    assert code == 0
    assert function == "fields" or f"{function} of plug-in 'half' failed" in out
    assert show("check", "-p", "half")[0] == 0


def test_a_packet_that_fails_is_raw(plug: Callable[..., None], show: Command) -> None:
    rtu = registry.get("modbus-rtu")
    plug("half", lambda: replace(rtu, name="half", packet=fails))
    assert show("show", "-p", "half", "-V")[0] == 0


def test_simulated_buses_of_others_outlive_one_that_fails_or_takes_their_name(plug: Callable[..., None]) -> None:
    usual = scenarios.names()
    rtu = registry.get("modbus-rtu")
    plug("half", lambda: replace(rtu, name="half", scenarios=fails))
    assert scenarios.names() == usual
    plug("other", lambda: replace(rtu, name="other"))
    assert scenarios.scenario("modbus-rtu").protocol == "modbus-rtu"


def test_a_plug_in_stays_the_same_value(plug: Callable[..., None]) -> None:
    found = replace(registry.get("n2"), name="half")
    plug("half", lambda: found)
    assert registry.get("half") is registry.get("half")
