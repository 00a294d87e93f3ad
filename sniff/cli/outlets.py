"""Options and start of outlets: whom a running capture tells its values and findings."""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from sniff.analysis.sanitizing import sanitized
from sniff.box.status import OutletLine
from sniff.bus.live import LiveBus
from sniff.cli import USAGE, Failure, targets
from sniff.outlet_settings import (
    PASSWORD_ENV,
    TOKEN_ENV,
    FileSettings,
    ListenSettings,
    OutletSettings,
    Secret,
    SettingsError,
    broker,
    listen,
)

if TYPE_CHECKING:
    from sniff.outlets.metrics_server import MetricsServer
    from sniff.outlets.outlet import Outlet
    from sniff.outlets.teller import Hearer, Teller
    from sniff.outlets.told import Told

MOST_SAID = 100


def add_outlets(parser: argparse.ArgumentParser) -> None:
    """Options of every command that listens. What they do not say, the configuration does."""
    group = parser.add_argument_group(
        "outlets",
        "Who is told values and findings meanwhile; also [mqtt], [influx], [json], [foxglove], [metrics] in\n"
        "sniff485.toml. One that falls behind is dropped from, with a count; the capture waits for none.",
    )
    group.add_argument(
        "--mqtt",
        metavar="URL",
        help=f"a broker: mqtt[s]://[USER@]HOST[:PORT]; the password is in {PASSWORD_ENV}, or in a file",
    )
    group.add_argument("--mqtt-password-file", metavar="FILE", help="the first line of it is the password")
    group.add_argument("--mqtt-ca", metavar="FILE", help="certificate (PEM) that the broker's is signed with")
    group.add_argument("--influx", metavar="FILE", help="InfluxDB line protocol into FILE; - is standard output")
    group.add_argument(
        "--json-lines", metavar="FILE", help="values, findings and health as JSON Lines into FILE; - is standard output"
    )
    group.add_argument(
        "--foxglove", metavar="[HOST:]PORT", help="serve the channels of a recording to Foxglove, on the loopback"
    )
    group.add_argument(
        "--metrics", metavar="[HOST:]PORT", help="serve OpenMetrics (/metrics) on the loopback; 0: any free port"
    )
    group.add_argument(
        "--allow-remote", action="store_true", help=f"HOST may be reached by others, who must show {TOKEN_ENV}"
    )
    group.add_argument("--token-file", metavar="FILE", help=f"with that token; default: the variable {TOKEN_ENV}")
    group.add_argument("--no-outlets", action="store_true", help="none that the configuration names")


def settings_of(args: argparse.Namespace) -> OutletSettings:
    """What options say, and behind them the configuration. Ends with exit code 2."""
    told = OutletSettings() if args.no_outlets else targets.configured().outlets
    try:
        return _over(args, told)
    except SettingsError as error:
        raise Failure(str(error), USAGE) from None


def _over(args: argparse.Namespace, told: OutletSettings) -> OutletSettings:
    if args.mqtt:
        try:
            said = broker(args.mqtt)
        except SettingsError as error:
            raise SettingsError(f"--mqtt: {error}") from None
        kept = told.mqtt or said
        told = replace(
            told, mqtt=replace(kept, host=said.host, port=said.port, tls=said.tls, user=said.user or kept.user)
        )
    if told.mqtt is not None and args.mqtt_password_file:
        told = replace(told, mqtt=replace(told.mqtt, password=Secret(PASSWORD_ENV, args.mqtt_password_file)))
    if told.mqtt is not None and args.mqtt_ca:
        told = replace(told, mqtt=replace(told.mqtt, ca=args.mqtt_ca))
    if told.mqtt is None and (args.mqtt_password_file or args.mqtt_ca):
        raise SettingsError("--mqtt-password-file, --mqtt-ca: of which broker? say with --mqtt URL")
    if args.influx:
        told = replace(told, influx=FileSettings(args.influx))
    if args.json_lines:
        told = replace(told, json=FileSettings(args.json_lines))
    return replace(
        told,
        foxglove=_listening(args, "foxglove", args.foxglove, told.foxglove),
        metrics=_listening(args, "metrics", args.metrics, told.metrics),
    )


def _listening(
    args: argparse.Namespace, name: str, said: str | None, configured: ListenSettings | None
) -> ListenSettings | None:
    if not said:
        return configured
    try:
        return listen(said, args.allow_remote, Secret(TOKEN_ENV, args.token_file) if args.token_file else None)
    except SettingsError as error:
        raise SettingsError(f"--{name}: {error}") from None


class Printed:
    """Prints values, findings and health as JSON Lines between the frames."""

    every = 0

    def tell(self, things: Sequence[Told]) -> None:
        """Print them."""
        from sniff.outlets import json_lines

        for one in things:
            line = json_lines.line(one)
            if line is not None:
                print(line)


@dataclass(slots=True)
class Telling:
    """Outlets at work. `said`: what they have to say to people; whoever owns the terminal prints it. `where`: what
    listens, as addresses; `metrics`: that of /metrics."""

    teller: Teller
    outlets: tuple[Outlet, ...]
    said: deque[str]
    server: MetricsServer | None = None
    where: list[str] = field(default_factory=list)
    metrics: str = ""

    def attach(self, live: LiveBus) -> None:
        """Tell of a bus, too; another capture of the same takes the place of the first."""
        self.teller.attach(live)

    def take_said(self) -> list[str]:
        """What they had to say since the last call."""
        return [self.said.popleft() for _ in range(len(self.said))]

    def lines(self) -> tuple[OutletLine, ...]:
        """How each of them fares, and what listens for others to ask."""
        told = [
            OutletLine(one.name, one.where, one.connected, one.trouble, one.sent, one.dropped) for one in self.outlets
        ]
        return (*told, *([OutletLine("metrics", self.metrics)] if self.metrics else []))

    @property
    def counted(self) -> str:
        """What is dropped, or does not get through, in words for a line; empty when all is well."""
        return ", ".join(one.counted for one in self.outlets if one.dropped or one.trouble)


def prepare(settings: OutletSettings, also: Sequence[Hearer] = ()) -> Telling | None:
    """Make outlets, before anything is captured; None where nobody wants to know. Ends with exit code 2 for one that
    cannot begin."""
    if settings == OutletSettings() and not also:
        return None
    try:
        return _made(settings, also)
    except SettingsError as error:
        raise Failure(str(error), USAGE) from None


@contextlib.contextmanager
def telling(lives: Sequence[LiveBus], told: Telling | None) -> Iterator[Telling | None]:
    """Meanwhile outlets are told what becomes known of these buses. At the end what was dropped is said."""
    if told is None:
        yield None
        return
    from sniff.outlets.outlet import close_all

    for live in lives:
        told.attach(live)
    for outlet in told.outlets:
        outlet.start()
    for address in told.where:
        print(f"sniff485: {address}", file=sys.stderr)
    try:
        yield told
    finally:
        close_all(told.outlets)
        if told.server is not None:
            told.server.close()
        _say_end(told)


def _say_end(told: Telling) -> None:
    for text in told.take_said():
        print(f"sniff485: {sanitized(text)}", file=sys.stderr)
    for outlet in told.outlets:
        if outlet.dropped:
            why = f" ({outlet.trouble})" if outlet.trouble else ""
            print(
                f"sniff485: {outlet.name}: {outlet.sent} sent, {outlet.dropped} DROPPED: nobody took them in time"
                f"{sanitized(why)}",
                file=sys.stderr,
            )


def _made(settings: OutletSettings, also: Sequence[Hearer]) -> Telling:
    from sniff.outlets.teller import Teller

    said: deque[str] = deque(maxlen=MOST_SAID)
    outlets = tuple(_outlets(settings, said))
    server = None if settings.metrics is None else _metrics(settings.metrics)

    def publish() -> None:
        from sniff.outlets.metrics import BusNow, exposition

        if server is not None:
            now = [BusNow(one.model, one.status.lost, one.ended is None, one.now) for one in teller.lives.values()]
            server.page = exposition(now, outlets)

    teller = Teller([*outlets, *also], None if server is None else publish)
    metrics = _address(settings.metrics, server)
    return Telling(teller, outlets, said, server, list(_addresses(metrics, outlets)), metrics)


def _addresses(metrics: str, outlets: Sequence[Outlet]) -> Iterator[str]:
    """What listens, and where."""
    if metrics:
        yield metrics
    for outlet in outlets:
        if getattr(outlet, "port", None) is not None:
            yield f"Foxglove: {outlet.where}"


def _address(settings: ListenSettings | None, server: MetricsServer | None) -> str:
    """Where the page of /metrics is; "" where there is none."""
    if server is None or settings is None:
        return ""
    return f"http://{replace(settings, port=server.port).address}/metrics"


def _metrics(there: ListenSettings) -> MetricsServer:
    from sniff.outlets.metrics_server import MetricsServer

    try:
        return MetricsServer(there.port, there.host, there.required_token())
    except OSError as error:
        raise SettingsError(f"--metrics {there.address}: {error.strerror}") from None


def _outlets(settings: OutletSettings, said: deque[str]) -> list[Outlet]:
    made: list[Outlet] = []
    if settings.mqtt is not None:
        from sniff.outlets.mqtt import MqttOutlet

        made.append(MqttOutlet(settings.mqtt, said.append))
        if settings.mqtt.password.is_open:
            said.append(f"{settings.mqtt.password.file}: everybody on this machine can read it (chmod 600)")
        local = ListenSettings(settings.mqtt.host, 0).is_local
        if not settings.mqtt.tls and not local and settings.mqtt.password.read() is not None:
            said.append(f"mqtt: the password goes to {settings.mqtt.host} unencrypted; mqtts:// does better")
    if settings.foxglove is not None:
        from sniff.outlets.foxglove import FoxgloveOutlet

        made.append(FoxgloveOutlet(settings.foxglove, said.append))
    if settings.influx is not None:
        from sniff.outlets import line_protocol
        from sniff.outlets.stream import StreamOutlet

        made.append(StreamOutlet("influx", settings.influx, line_protocol.line, said.append))
    if settings.json is not None:
        from sniff.outlets import json_lines
        from sniff.outlets.stream import StreamOutlet

        made.append(StreamOutlet("json", settings.json, json_lines.line, said.append))
    return made
