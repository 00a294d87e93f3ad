"""`config show` prints every value in force with the file and line it comes from."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict, fields
from typing import Any

from sniff.analysis.sanitizing import sanitized
from sniff.cli import USAGE, Failure, json_output
from sniff.config import FILE, Config, ConfigError, load
from sniff.outlet_settings import FileSettings, ListenSettings, MqttSettings, Secret


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `config`."""
    parser.add_argument("action", choices=["show"], help="show: what is configured, and where")
    parser.add_argument("--json", action="store_true", help="one JSON object a bus")


def run(args: argparse.Namespace) -> int:
    """Print the configuration."""
    try:
        config = load()
    except ConfigError as error:
        raise Failure(str(error), USAGE) from None
    if config.path is None and not args.json:
        print(f"no {FILE} in this folder, above it, or in the user's configuration folder")
    for bus in config.buses.values():
        values = {
            "port": bus.port,
            "line": str(bus.line) if bus.line is not None else None,
            "protocol": bus.protocol,
            "record": bus.record,
            "devices": dict(bus.devices) or None,
        }
        if args.json:
            print(json_output.dumps({"bus": bus.name, **values, "from": dict(bus.origin)}))
            continue
        print(f"[bus.{sanitized(bus.name)}]")
        for key, value in values.items():
            if value is not None:
                print(f"  {key} = {value!r}  # {sanitized(bus.origin.get(key, config.path))}")
    for section, values in _sections(config):
        if not values:
            continue
        if args.json:
            print(json_output.dumps({section: values, "from": str(config.path)}))
            continue
        print(f"[{section}]")
        for key, value in values.items():
            print(f"  {key} = {value!r}  # {sanitized(config.path)}")
    return 0


def _sections(config: Config) -> Iterator[tuple[str, dict[str, Any]]]:
    """Everything besides the buses: values as they are in force, also those that the file leaves to us."""
    if config.alert is not None:
        alert = config.alert
        told = {"command": list(alert.command) or None, "webhook": alert.webhook or None}
        yield "alert", _said({**told, "at": alert.least.label, "every": alert.every})
    yield "box", _said(asdict(config.box))
    for one in fields(config.outlets):
        settings = getattr(config.outlets, one.name)
        if settings is not None:
            yield one.name, _outlet(settings)
    yield "filters", dict(config.filters)
    yield "colours", dict(config.colours)
    for name, view in config.views.items():
        lists = {which: list(columns) for which, columns in view.columns.items()}
        yield f"view.{name}", _said({**lists, "time": view.time or None, "filter": view.filter or None})
    yield "keys", dict(config.keys)


def _outlet(settings: MqttSettings | FileSettings | ListenSettings) -> dict[str, Any]:
    """Where secrets are, never the secrets."""
    if isinstance(settings, FileSettings):
        return asdict(settings)
    if isinstance(settings, ListenSettings):
        return {"listen": settings.address, "allow_remote": settings.allow_remote, **_secret("token", settings.token)}
    told: dict[str, Any] = {key: value for key, value in asdict(settings).items() if value != ""}
    told["discovery"] = settings.discovery
    for key in ("host", "port", "tls", "password"):
        del told[key]
    broker = f"mqtt{'s' if settings.tls else ''}://{settings.host}:{settings.port}"
    return {"broker": broker, **told, **_secret("password", settings.password)}


def _secret(name: str, secret: Secret) -> dict[str, str]:
    return {f"{name}_file": secret.file} if secret.file else {f"{name}_env": secret.env}


def _said(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
