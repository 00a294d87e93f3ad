"""Options of outlets: what cannot be tried is said before anything begins, and no secret is repeated."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from sniff.cli import Failure, main, outlets
from sniff.outlet_settings import ListenSettings, Secret, SettingsError, listen

TOKEN = "a token that is long enough"


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SNIFF485_TOKEN", raising=False)
    monkeypatch.delenv("SNIFF485_MQTT_PASSWORD", raising=False)


def given(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    outlets.add_outlets(parser)
    return parser.parse_args(words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--mqtt", "mqtt://me:geheim@localhost"), "no password in an address"),
        (("--mqtt", "http://localhost"), "expected mqtt://"),
        (("--mqtt", "mqtt://h:99999"), "expected mqtt://"),
        (("--mqtt", "mqtt://h", "--mqtt-password-file", "/no/such"), "/no/such: No such file"),
        (("--mqtt-password-file", "x"), "of which broker?"),
        (("--mqtt", "mqtts://localhost", "--mqtt-ca", "/no/ca.pem"), "/no/ca.pem: No such file"),
        (("--influx", "/no/such/file"), "/no/such/file: No such file"),
        (("--metrics", "70000"), "expected a port"),
        (("--metrics", "0.0.0.0:0"), "--allow-remote"),
        (("--metrics", "example.org:80"), "can be reached from other machines"),
        (("--metrics", "0.0.0.0:0", "--allow-remote"), "set a token in SNIFF485_TOKEN"),
        (("--metrics", "[::]:0", "--allow-remote", "--token-file", "/no/token"), "/no/token: No such file"),
    ],
)
def test_what_cannot_be_tried_is_said_before_anything_begins(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    assert main(["record", "/dev/null", "-s", "9600,8N1", "-w", "x.mcap", *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert "geheim" not in told
    assert not (tmp_path / "x.mcap").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[mqtt]\nbroker = "mqtt://h"\npassword = "geheim"\n', "password_file or password_env"),
        ('[mqtt]\nbroker = "mqtt://u:geheim@h"\n', "no password in an address"),
        ('[mqtt]\nuser = "u"\n', "expected mqtt://"),
        ('[mqtt]\nbroker = "mqtt://h"\nprefix = "a/#"\n', "expected a topic"),
        ('[mqtt]\nbroker = "mqtt://h"\nbroke = "x"\n', "did you mean 'broker'?"),
        ('[mqtt]\nbroker = "mqtt://h"\nevery = -1\n', "expected seconds"),
        ('[mqtt]\nbroker = "mqtt://h"\nkey = "x"\n', "go together"),
        ("[influx]\nevery = 1\n", "say where"),
        ('[foxglove]\nlisten = "x"\n', "expected a port"),
        ('[metrics]\nlisten = 9485\ntoken = "geheim"\n', "token_file or token_env"),
        ("[metrics]\nlisten = 9485\nallow_remote = 1\n", "expected true or false"),
    ],
)
def test_a_wrong_configuration_names_file_and_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    (tmp_path / "sniff485.toml").write_text(text)
    assert main(["record", "/dev/null", "-s", "9600,8N1"]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert "sniff485.toml:" in told
    assert "geheim" not in told


def test_flags_stand_over_the_configuration(tmp_path: Path) -> None:
    (tmp_path / "sniff485.toml").write_text(
        '[mqtt]\nbroker = "mqtts://u@one"\nprefix = "plant"\ndiscovery = ""\n'
        '[influx]\nfile = "a"\n[metrics]\nlisten = 1\n'
    )
    told = outlets.settings_of(given("--mqtt", "mqtt://two:99"))
    assert told.mqtt is not None
    assert (told.mqtt.host, told.mqtt.port, told.mqtt.tls, told.mqtt.user) == ("two", 99, False, "u")
    assert (told.mqtt.prefix, told.mqtt.discovery) == ("plant", "")
    assert told.influx is not None
    assert told.metrics is not None
    assert told.metrics.address == "127.0.0.1:1"
    assert outlets.settings_of(given("--no-outlets")) == outlets.OutletSettings()


def test_it_listens_on_the_loopback_unless_told_otherwise(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert listen("9485") == ListenSettings("127.0.0.1", 9485)
    assert listen("9485").required_token() is None
    assert listen("[::1]:9485").required_token() is None
    with pytest.raises(SettingsError, match="allow_remote"):
        listen("0.0.0.0:9485").required_token()
    monkeypatch.setenv("SNIFF485_TOKEN", "short")
    with pytest.raises(SettingsError, match="16 characters"):
        listen("0.0.0.0:9485", True).required_token()
    monkeypatch.setenv("SNIFF485_TOKEN", TOKEN)
    assert listen("0.0.0.0:9485", True).required_token() == TOKEN
    (tmp_path / "token").write_text(TOKEN + "\n")
    assert listen("1", token=Secret("SNIFF485_TOKEN", str(tmp_path / "token"))).required_token() == TOKEN


def test_a_secret_is_in_no_representation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SNIFF485_MQTT_PASSWORD", "geheim")
    told = outlets.settings_of(given("--mqtt", "mqtt://u@h"))
    assert told.mqtt is not None
    assert told.mqtt.password.read() == "geheim"
    assert "geheim" not in repr(told)


def test_a_file_that_is_no_secret_is_refused(tmp_path: Path) -> None:
    (tmp_path / "large").write_bytes(b"x" * 5000)
    with pytest.raises(SettingsError, match="is no secret"):
        Secret("X", str(tmp_path / "large")).read()
    (tmp_path / "binary").write_bytes(b"\xff\xfe")
    with pytest.raises(SettingsError, match="UTF-8"):
        Secret("X", str(tmp_path / "binary")).read()
    with pytest.raises(Failure, match="No such file"):
        outlets.prepare(outlets.settings_of(given("--mqtt", "mqtt://h", "--mqtt-password-file", str(tmp_path / "no"))))
