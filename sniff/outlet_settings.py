"""Outlets as the configuration names them: brokers, files, ports to listen at, and where their secrets are.

    [mqtt]
    broker = "mqtts://broker.example:8883"   # mqtt:// without TLS
    user = "plant-room"
    password_file = "/etc/sniff485/mqtt"     # or password_env = "NAME"; default: SNIFF485_MQTT_PASSWORD
    ca = "/etc/sniff485/ca.pem"              # default: what this system trusts
    prefix = "sniff485"                      # topics begin with it
    discovery = "homeassistant"              # "" for none
    every = 1                                # seconds between two values of a point; 0: each of them

    [influx]
    file = "values.lp"                       # "-" for standard output

    [json]
    file = "values.jsonl"

    [foxglove]
    listen = "127.0.0.1:8765"

    [metrics]
    listen = "0.0.0.0:9485"
    allow_remote = true                      # what others can reach needs this, and a token:
    token_file = "/etc/sniff485/token"       # or token_env = "NAME"; default: SNIFF485_TOKEN

A secret stands in the environment or in a file, nowhere else: neither here nor on a command line.
"""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

PASSWORD_ENV, TOKEN_ENV = "SNIFF485_MQTT_PASSWORD", "SNIFF485_TOKEN"
LEAST_TOKEN = 16
"""Characters of a token: fewer can be guessed."""

MOST_SECRET = 4096
"""Octets of a file with a secret; a longer one is something else."""

SCHEMES = {"mqtt": 1883, "mqtts": 8883}
MQTT_KEYS = (
    "broker", "user", "password_env", "password_file", "ca", "certificate", "key", "prefix", "discovery", "every",
    "client_id",
)  # fmt: skip
FILE_KEYS = ("file", "every")
LISTEN_KEYS = ("listen", "allow_remote", "token_env", "token_file")
SECRETS = ("password", "token", "pass", "secret")
TABLES = ("mqtt", "influx", "json", "foxglove", "metrics")


class SettingsError(ValueError):
    """An outlet cannot be as it was told; the message holds no secret."""


@dataclass(frozen=True, slots=True)
class Secret:
    """Where a secret is: the name of a variable of the environment, else a file. Never the secret itself."""

    env: str
    file: str = ""

    def read(self) -> str | None:
        """It; None where nobody set it. Raises SettingsError for a file that cannot be read."""
        if not self.file:
            return os.environ.get(self.env) or None
        try:
            with open(self.file, "rb") as opened:
                text = opened.read(MOST_SECRET + 1).decode()
        except OSError as error:
            raise SettingsError(f"{self.file}: {error.strerror}") from None
        except UnicodeDecodeError:
            raise SettingsError(f"{self.file}: a secret is text in UTF-8") from None
        if len(text) > MOST_SECRET:
            raise SettingsError(f"{self.file}: longer than {MOST_SECRET} octets is no secret")
        return text.strip("\r\n") or None

    @property
    def is_open(self) -> bool:
        """Whether everybody on this machine may read its file."""
        try:
            return bool(self.file) and os.name == "posix" and bool(Path(self.file).stat().st_mode & 0o004)
        except OSError:
            return False


@dataclass(frozen=True, slots=True)
class MqttSettings:
    """`every`: seconds between two values of a point. `ca`, `certificate`, `key`: paths of PEM files; the latter two
    show who we are, where a broker asks for that. `discovery`: prefix of Home Assistant's discovery topics, "": none.
    """

    host: str
    port: int
    tls: bool
    user: str = ""
    password: Secret = Secret(PASSWORD_ENV)
    ca: str = ""
    certificate: str = ""
    key: str = ""
    prefix: str = "sniff485"
    discovery: str = "homeassistant"
    every: float = 1.0
    client_id: str = ""


@dataclass(frozen=True, slots=True)
class FileSettings:
    """A file that is written to; "-" is standard output. `every`: as of MQTT; 0: each value."""

    file: str
    every: float = 0.0


@dataclass(frozen=True, slots=True)
class ListenSettings:
    """Where to listen. Not on the loopback only where `allow_remote` says so, and then only with a token."""

    host: str
    port: int
    allow_remote: bool = False
    token: Secret = Secret(TOKEN_ENV)

    @property
    def address(self) -> str:
        """For people: "127.0.0.1:8765"."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    @property
    def is_local(self) -> bool:
        """Whether only this machine reaches it."""
        try:
            return self.host == "localhost" or ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False

    def required_token(self) -> str | None:
        """The token that everybody must show; None where none is needed. Raises SettingsError where it may not listen
        there: what other machines can reach needs leave, and a token."""
        token = self.token.read()
        if self.is_local:
            return token if self.token.file or self.token.env != TOKEN_ENV else None
        if not self.allow_remote:
            raise SettingsError(
                f"{self.address} can be reached from other machines: --allow-remote (allow_remote = true) permits it"
            )
        if token is None:
            raise SettingsError(
                f"{self.address} can be reached from other machines: set a token in {self.token.env}, or name a file "
                "with one (--token-file, token_file)"
            )
        if len(token) < LEAST_TOKEN:
            raise SettingsError(f"{self.address}: a token has {LEAST_TOKEN} characters at least")
        return token


@dataclass(frozen=True, slots=True)
class OutletSettings:
    """All outlets; None for those that nobody wants."""

    mqtt: MqttSettings | None = None
    influx: FileSettings | None = None
    json: FileSettings | None = None
    foxglove: ListenSettings | None = None
    metrics: ListenSettings | None = None


def broker(url: str, password: Secret | None = None) -> MqttSettings:
    """Of a URL: mqtt[s]://[user@]host[:port]. Raises SettingsError; a password in it is refused, and not repeated."""
    try:
        parts = urlsplit(url if "://" in url else f"mqtt://{url}")
        port, secret = parts.port, parts.password
    except ValueError:
        raise SettingsError("expected mqtt://host, mqtts://host:8883 or mqtts://user@host") from None
    if secret is not None:
        raise SettingsError(f"no password in an address: set {PASSWORD_ENV}, or name a file with it")
    if parts.scheme not in SCHEMES or not parts.hostname or parts.path not in ("", "/") or parts.query:
        raise SettingsError("expected mqtt://host, mqtts://host:8883 or mqtts://user@host")
    return MqttSettings(
        parts.hostname,
        SCHEMES[parts.scheme] if port is None else port,
        parts.scheme == "mqtts",
        parts.username or "",
        password or Secret(PASSWORD_ENV),
    )


def listen(text: str, allow_remote: bool = False, token: Secret | None = None) -> ListenSettings:
    """Of "8765", "127.0.0.1:8765" or "[::1]:8765". Raises SettingsError."""
    host, _, port = text.rpartition(":")
    host = host.strip("[]") or "127.0.0.1"
    if not re.fullmatch(r"\d{1,5}", port) or int(port) > 65535:
        raise SettingsError(f"{text!r}: expected a port, or HOST:PORT")
    return ListenSettings(host, int(port), allow_remote, token or Secret(TOKEN_ENV))


class TableReader(Protocol):
    """What reads a configuration: errors name file, line and key."""

    def check_keys(self, entry: Mapping[str, Any], known: tuple[str, ...], section: str) -> None:
        """Refuse keys that nobody knows."""

    def text(self, entry: Mapping[str, Any], key: str, section: str) -> str | None:
        """A text, or None."""

    def table(self, value: Any, name: str) -> Mapping[str, Any]:
        """A table."""

    def error(self, key: str, section: str, what: str) -> Exception:
        """What is raised."""


def outlets(reader: TableReader, data: Mapping[str, Any]) -> OutletSettings:
    """What a configuration says of all of them."""
    found = {name: reader.table(data[name], name) for name in TABLES if name in data}
    return OutletSettings(
        _mqtt(reader, found["mqtt"]) if "mqtt" in found else None,
        _file(reader, found["influx"], "influx") if "influx" in found else None,
        _file(reader, found["json"], "json") if "json" in found else None,
        _listen(reader, found["foxglove"], "foxglove") if "foxglove" in found else None,
        _listen(reader, found["metrics"], "metrics") if "metrics" in found else None,
    )


def _mqtt(reader: TableReader, entry: Mapping[str, Any]) -> MqttSettings:
    _refuse_secrets(reader, entry, "mqtt", "password_file", "password_env")
    reader.check_keys(entry, MQTT_KEYS, "mqtt")
    texts = {key: reader.text(entry, key, "mqtt") for key in MQTT_KEYS if key != "every"}
    try:
        told = broker(texts["broker"] or "")
    except SettingsError as error:
        raise reader.error("broker", "mqtt", f"broker: {error}") from None
    prefix, discovery = (
        told_or if told_or is not None else default
        for told_or, default in ((texts["prefix"], told.prefix), (texts["discovery"], told.discovery))
    )
    for key, topic in (("prefix", prefix), ("discovery", discovery)):
        if not is_topic(topic) and not (key == "discovery" and topic == ""):
            raise reader.error(key, "mqtt", f"{topic!r}: expected a topic without +, # and empty levels")
    if bool(texts["certificate"]) is not bool(texts["key"]):
        raise reader.error("certificate", "mqtt", "certificate and key go together")
    return MqttSettings(
        told.host,
        told.port,
        told.tls,
        texts["user"] or told.user,
        Secret(texts["password_env"] or PASSWORD_ENV, texts["password_file"] or ""),
        texts["ca"] or "",
        texts["certificate"] or "",
        texts["key"] or "",
        prefix,
        discovery,
        _seconds(reader, entry, "mqtt", 1.0),
        texts["client_id"] or "",
    )


def _file(reader: TableReader, entry: Mapping[str, Any], section: str) -> FileSettings:
    reader.check_keys(entry, FILE_KEYS, section)
    file = reader.text(entry, "file", section)
    if not file:
        raise reader.error("file", section, 'say where: file = "values.txt", or "-" for standard output')
    return FileSettings(file, _seconds(reader, entry, section, 0.0))


def _listen(reader: TableReader, entry: Mapping[str, Any], section: str) -> ListenSettings:
    _refuse_secrets(reader, entry, section, "token_file", "token_env")
    reader.check_keys(entry, LISTEN_KEYS, section)
    where, allow = entry.get("listen"), entry.get("allow_remote", False)
    if isinstance(where, int) and not isinstance(where, bool):
        where = str(where)
    if not isinstance(where, str):
        raise reader.error("listen", section, f"say where: listen = {'127.0.0.1:8765'!r}")
    if not isinstance(allow, bool):
        raise reader.error("allow_remote", section, f"expected true or false, not {allow!r}")
    env, file = (reader.text(entry, key, section) or "" for key in ("token_env", "token_file"))
    try:
        return listen(where, allow, Secret(env or TOKEN_ENV, file))
    except SettingsError as error:
        raise reader.error("listen", section, str(error)) from None


def is_topic(text: str) -> bool:
    """Whether it is a topic that can be published to."""
    return bool(text) and text.isprintable() and not set(text) & set("+#") and all(text.split("/"))


def _seconds(reader: TableReader, entry: Mapping[str, Any], section: str, default: float) -> float:
    value = entry.get("every", default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 86400:
        raise reader.error("every", section, f"expected seconds, not {value!r}")
    return float(value)


def _refuse_secrets(reader: TableReader, entry: Mapping[str, Any], section: str, *ways: str) -> None:
    for key in entry:
        if key in SECRETS:
            raise reader.error(key, section, f"no secrets in a configuration: use {' or '.join(ways)}")
