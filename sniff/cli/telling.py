"""The outlets of a running capture: triggers mark it, alerts leave it."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator, Sequence

from sniff.analysis.sanitizing import sanitized
from sniff.bus.triggers import Triggers
from sniff.cli import USAGE, Failure, targets
from sniff.cli.printing import Printer
from sniff.filter import Scope


def add_triggers(printers: Sequence[Printer], words: Sequence[str]) -> None:
    """Watch every bus for what `--on` names; ends with exit code 2 for what cannot be understood."""
    for printer in printers if words else ():
        live = printer.live
        try:
            printer.triggers = Triggers(words, live.dissector, Scope(live.session.started, live.devices))
        except ValueError as error:
            live.link.stop()
            raise Failure(f"--on: {error}", USAGE) from None


@contextlib.contextmanager
def alerting(printers: Sequence[Printer]) -> Iterator[None]:
    """Meanwhile whoever the configuration names is told what is new about the buses."""
    settings = targets.configured().alert
    if settings is None:
        yield
        return
    from sniff.outlets.alerts import Alerts
    from sniff.outlets.news import NewsDesk

    alerts = Alerts(settings, lambda text: print(f"sniff485: {sanitized(text)}", file=sys.stderr))
    for printer in printers:
        printer.alerts = alerts, NewsDesk(settings.least, int(settings.every * 1e9))
    try:
        yield
    finally:
        alerts.close()
        if alerts.dropped:
            print(f"sniff485: {alerts.dropped} alerts dropped: nobody took them in time", file=sys.stderr)
