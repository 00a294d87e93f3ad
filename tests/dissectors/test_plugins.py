"""Plug-ins that cannot be used, or whose functions raise: one line that names them, never a traceback."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from dissectors import registry
from dissectors.manifest import Dissector
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


@pytest.mark.parametrize("function", ["peek", "text", "fields"])
@pytest.mark.parametrize("given", [None, 3, {"half.x": object()}])
def test_what_is_no_such_thing_is_said_at_its_row(
    plug: Callable[..., None], show: Command, function: str, given: Any
) -> None:
    rtu = registry.get("modbus-rtu")
    plug("half", lambda: replace(rtu, name="half", **{function: lambda *_: given}))
    for how in (("--json", "--fields"), ("-V",), ("-Y", "modbus.func_code == 3 || ok"), ()):
        assert show("show", "-p", "half", *how)[0] == 0, how
    assert f"{function} of plug-in 'half' failed: TypeError: " in show("show", "-p", "half", "--json", "--fields")[1]


@pytest.mark.parametrize("function", ["framer", "tracker", "judge"])
def test_where_no_row_can_say_it_the_command_names_the_plug_in(
    plug: Callable[..., None], show: Command, function: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is no defect of this program, so that nobody reports it here."""
    (tmp_path / "package_half.py").write_text("def fails(*_):\n    raise ValueError('it broke')\n")
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module("package_half")
    monkeypatch.setitem(sys.modules, "package_half", module)
    rtu = registry.get("modbus-rtu")
    plain = dict.fromkeys(("kernel", "pairing", "reading_columns", "stencil"))
    plug("half", lambda: replace(rtu, name="half", **plain, **{function: module.fails}))
    code, _, err = show("check", "-p", "half")
    assert code == 70
    assert "sniff485: plug-in 'half' of package package-half failed: ValueError: it broke (" in err
    assert "/package_half.py:2); please report it to whoever made it" in err


def test_optional_parts_go_by_their_names() -> None:
    """Many take one and the same type: by place one would pass for another."""
    rtu = registry.get("modbus-rtu")
    needed = (rtu.name, rtu.title, rtu.framer, rtu.peek, rtu.tracker, rtu.text, rtu.fields, rtu.packet)
    assert Dissector(*needed, default_line="9600,7E1").default_line == "9600,7E1"
    with pytest.raises(TypeError, match="positional"):
        Dissector(*needed, "9600,7E1")  # type: ignore[misc]


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


class Renames:
    """A renamer without numbers of stations, that gives what a test wants."""

    def __init__(self, octets: bytes | None = None) -> None:
        self._octets = octets

    def __call__(self, frame: Any) -> bytes:
        return frame.octets if self._octets is None else self._octets


def test_a_renamer_without_stations_leaves_devices_out(plug: Callable[..., None], tmp_path: Path) -> None:
    plug("quiet", lambda: replace(registry.get("modbus-rtu"), name="quiet", renamer=Renames))
    heard, given = tmp_path / "a.cap.txt", tmp_path / "b.cap.txt"
    heard.write_text("#!sniff-capture 1\n# line: 19200,8E1\n# device: 1=teco-e510\n+5 01 03 00 00 00 02 C4 0B\n")
    assert main(["anonymise", str(heard), "-o", str(given), "-p", "quiet"]) == 0
    assert "01 03 00 00 00 02 C4 0B" in given.read_text()
    assert "teco" not in given.read_text()


def test_a_renamed_frame_of_another_length_is_one_line(
    plug: Callable[..., None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plug("long", lambda: replace(registry.get("modbus-rtu"), name="long", renamer=lambda: Renames(bytes(9))))
    heard = tmp_path / "a.hex"
    heard.write_text("01 03 00 00 00 02 C4 0B\n")
    assert main(["anonymise", str(heard), "-o", str(tmp_path / "b.cap.txt"), "-p", "long"]) == 2
    assert capsys.readouterr().err.endswith("sniff485: plug-in 'long' renames a frame of 8 octets to one of 9\n")
