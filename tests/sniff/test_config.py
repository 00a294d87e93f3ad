"""sniff485.toml: buses by name, and errors that say where."""

import json
import sys
from pathlib import Path

import pytest

from sniff.cli import main
from sniff.config import BoxSettings, ConfigError, load, parse


def write(folder: Path, text: str) -> Path:
    path = folder / "sniff485.toml"
    path.write_text(text)
    return path


def test_a_bus_has_its_values_and_their_lines(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        '[bus.boiler-room]\nport = "/dev/ttyUSB0"\nline = "19200,8E1"\n\n[bus.boiler-room.devices]\n3 = "teco-e510"\n',
    )
    bus = parse(path).buses["boiler-room"]
    assert (bus.port, str(bus.line), bus.protocol) == ("/dev/ttyUSB0", "19200,8E1", None)
    assert bus.devices == {"3": "teco-e510"}
    assert bus.origin["line"] == f"{path}:3"
    assert bus.origin["devices"] == f"{path}:5"


def test_the_folder_above_counts(tmp_path: Path) -> None:
    write(tmp_path, '[bus.a]\nport = "x"\n')
    inner = tmp_path / "one" / "two"
    inner.mkdir(parents=True)
    assert load(inner).buses["a"].port == "x"


@pytest.mark.skipif(sys.platform == "win32", reason="a folder that is in use cannot be removed there")
def test_a_current_folder_that_is_gone_is_said(tmp_path: Path, monkeypatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with pytest.raises(ConfigError, match="the current folder is not there any more"):
        load()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('[bus.a]\nlnie = "9600"\n', ":2: [bus.a] unknown key 'lnie'; did you mean 'line'?"),
        ('[bus.a]\n\nline = "fast"\n', ":3: [bus.a] line settings 'fast'"),
        ('[bus.a]\nprotocol = "modbusrtu"\n', ":2: [bus.a] unknown protocol 'modbusrtu'; did you mean 'modbus-rtu'?"),
        ("[bus.a]\nport = 3\n", ":2: [bus.a] expected a text in quotes, not 3"),
        ('[bus.a.devices]\n300 = "x"\n', ":2: [bus.a.devices] '300': expected an address 0 … 255"),
        ("[bus.a.devices]\n3 = 4\n", ":2: [bus.a.devices] expected a text in quotes, not 4"),
        ("[buss.a]\n", "unknown key 'buss'; did you mean 'bus'?"),
        ("bus = 1\n", "expected a table [bus]"),
        ("[bus.a\n", "sniff485.toml: "),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse(write(tmp_path, text))
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_nesting_without_end_is_a_mistake(tmp_path: Path) -> None:
    path = tmp_path / "sniff485.toml"
    path.write_text("a = " + "[" * 20_000)
    with pytest.raises(ConfigError, match=r"sniff485\.toml"):
        parse(path)


def test_filters_by_name_and_colour(tmp_path: Path) -> None:
    path = write(tmp_path, '[filters]\nslow = "latency_ms > 50ms"\n\n[colours]\nmagenta = "kind contains write"\n')
    config = parse(path)
    assert config.filters == {"slow": "latency_ms > 50ms"}
    assert config.colours == {"magenta": "kind contains write"}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            '[filters]\nslow = "latency > 50"\n',
            "[filters] slow: unknown name 'latency' (did you mean 'latency_ms'?",
        ),
        ('[colours]\nred = "ok == maybe"\n', ":2: [colours] red: ok is true or false"),
        ('[colours]\nmagneta = "ok"\n', "did you mean 'magenta'?"),
    ],
)
def test_a_wrong_filter_is_named_with_its_place(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse(write(tmp_path, text))
    assert expected in str(caught.value)


def test_the_box(tmp_path: Path) -> None:
    path = tmp_path / "sniff485.toml"
    path.write_text('[box]\nfolder = "/data"\nrotate = "time:1h"\nkeep = 9\nkeep_free = "2GB"\nstatus = 0\n')
    assert parse(path).box == BoxSettings("/data", None, "time:1h", 9, "2GB", None, 0)
    path.write_text("[filters]\n")
    assert parse(path).box == BoxSettings()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('folders = "/data"', "did you mean 'folder'"),
        ("keep = 0", "expected a whole number from 1 on, not 0"),
        ("keep = true", "expected a whole number"),
        ('name = "a/b"', "name files"),
        ("rotate = 7", "expected a text in quotes"),
    ],
)
def test_what_a_box_cannot_be_told(tmp_path: Path, line: str, said: str) -> None:
    path = tmp_path / "sniff485.toml"
    path.write_text(f"[box]\n{line}\n")
    with pytest.raises(ConfigError, match=r"sniff485\.toml:2: ") as caught:
        parse(path)
    assert said in str(caught.value)


def test_config_show_shows_every_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write(
        tmp_path,
        """
        [alert]
        webhook = "https://a.example/hook"
        [box]
        keep = 3
        [mqtt]
        broker = "mqtts://me@b.example"
        password_file = "/no/such"
        [json]
        file = "-"
        [metrics]
        listen = 9485
        [filters]
        slow = "latency_ms > 50ms"
        [colours]
        red = "dst == 3"
        [view.few]
        frames = ["no"]
        [keys]
        mark = "ctrl+b"
        """,
    )
    assert main(["config", "show"]) == 0
    said = capsys.readouterr().out
    for line in (
        "webhook = 'https://a.example/hook'", "at = 'warning'", "keep = 3", "broker = 'mqtts://b.example:8883'",
        "user = 'me'", "password_file = '/no/such'", "file = '-'", "listen = '127.0.0.1:9485'", "allow_remote = False",
        "slow = 'latency_ms > 50ms'", "red = 'dst == 3'", "frames = ['no']", "mark = 'ctrl+b'",
    ):  # fmt: skip
        assert f"  {line}  # " in said
    assert main(["config", "show", "--json"]) == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    tables = ["alert", "box", "mqtt", "json", "metrics", "filters", "colours", "view.few", "keys"]
    assert [next(iter(one)) for one in told] == tables
