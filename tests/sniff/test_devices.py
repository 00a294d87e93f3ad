"""Profiles by name: package, project, user and other packages; devices by address."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from dissectors.profiles import ProfileError
from sniff import devices as profile_files
from sniff.devices import UnknownProfile, available, devices, find, made_for, says_of

PUMP = 'name = "pump"\ntitle = "{title}"\nprotocols = ["modbus-rtu"]\n'


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "work" / "deep").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "work" / "deep")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("APPDATA", str(tmp_path / "config"))


def put(folder: Path, name: str, title: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.toml"
    path.write_text(PUMP.format(title=title), "utf-8")
    return path


def test_packaged_profiles() -> None:
    assert find("teco-e510").name == "teco-e510"
    assert {"teco-e510", "teco-f510", "automationdirect-acn"} <= {listed.name for listed in available()}


def test_the_nearest_wins(tmp_path: Path) -> None:
    put(tmp_path / "config" / "sniff485" / "profiles", "pump", "the user's")
    assert find("pump").title == "the user's"
    put(tmp_path / "work" / "profiles", "pump", "the project's")
    assert find("pump").title == "the project's"
    put(tmp_path / "work" / "profiles", "teco-e510", "mine")
    assert find("teco-e510").title == "mine"
    assert [listed.origin for listed in available() if listed.name == "pump"] == [
        str(tmp_path / "work" / "profiles" / "pump.toml")
    ]


def test_a_path(tmp_path: Path) -> None:
    assert find(str(put(tmp_path, "x", "by path"))).title == "by path"


def test_unknown_and_broken_ones(tmp_path: Path) -> None:
    with pytest.raises(UnknownProfile, match=r"did you mean 'teco-e510'"):
        find("teco-e51")
    with pytest.raises(ProfileError, match=r"nowhere\.toml: No such file"):
        find("nowhere.toml")
    broken = put(tmp_path / "work" / "profiles", "broken", "x")
    broken.write_text("name = 3", "utf-8")
    with pytest.raises(ProfileError, match=r"broken\.toml: name: expected a text"):
        find("broken")
    listed = next(listed for listed in available() if listed.name == "broken")
    assert listed.profile is None
    assert "expected a text" in listed.error
    broken.write_bytes(b"\xff\xfe")
    with pytest.raises(ProfileError, match=r"broken\.toml"):
        find("broken")


def test_profiles_of_other_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    class Point(EntryPoint):
        def load(self) -> object:
            return {"good": PUMP.format(title="plugged"), "bad": 7}[self.name]

    points = [Point(name, "somewhere:THING", profile_files.GROUP) for name in ("good", "bad")]
    monkeypatch.setattr(profile_files, "entry_points", lambda group: points)
    assert find("good").title == "plugged"
    with pytest.raises(ProfileError, match="neither a text nor a path"):
        find("bad")
    assert {"good", "bad"} <= {listed.name for listed in available()}


def test_devices() -> None:
    found = devices({"3": "teco-e510", "0x10": "teco-f510", "*": "automationdirect-acn"})
    at = {address: profile.name for address in (3, 16, 5, None) if (profile := found.at(address)) is not None}
    assert at == {3: "teco-e510", 16: "teco-f510", 5: "automationdirect-acn", None: "automationdirect-acn"}
    assert found.text() == "3=teco-e510,16=teco-f510,*=automationdirect-acn"
    assert [profile.name for profile in found.profiles] == ["teco-e510", "teco-f510", "automationdirect-acn"]
    assert not devices({})
    for wrong in ("300", "x", "-1"):
        with pytest.raises(ValueError, match="expected an address 0 … 255"):
            devices({wrong: "teco-e510"})


def test_another_profile_of_the_device_for_the_protocol_of_the_capture() -> None:
    acn, card = find("automationdirect-acn"), find("automationdirect-acn-eth")
    assert made_for(acn, "modbus-tcp") == card
    assert made_for(card, "modbus-rtu") == acn
    assert made_for(acn, "modbus-rtu") is None
    assert made_for(find("teco-e510"), "modbus-tcp") is None


def test_what_a_profile_has_nothing_to_say_of() -> None:
    e510 = find("teco-e510")
    assert all(says_of(e510, name) for name in ("modbus-rtu", "modbus-ascii", "modbus-tcp", "mstp", "bacnet-ip"))
    assert not any(says_of(e510, name) for name in ("n2", "profibus"))
    assert says_of(find("automationdirect-acn-eth"), "modbus-rtu")
