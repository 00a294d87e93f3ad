"""-Y, wherever frames are read. What carries a filter out is imported when there is one."""

from __future__ import annotations

import argparse
import contextlib
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from dissectors import registry
from dissectors.findings import Finding
from dissectors.profiles import Devices
from sniff.analysis.sanitizing import sanitized
from sniff.bus.offline import survey
from sniff.cli import USAGE, Failure, arguments
from sniff.cli.progress import Watched
from sniff.engine.capture import Capture, CaptureError
from sniff.engine.follow_settings import dissector_for
from sniff.engine.observer import Observer
from sniff.engine.read_source import ReadSource
from sniff.engine.session import SECOND_NOTE, LineEvent, Session

if TYPE_CHECKING:
    from sniff.bus.second_proof import SecondProof
    from sniff.filter import Filter, Scope


def add_filter(parser: argparse.ArgumentParser, what: str = "only frames that match") -> None:
    """-Y, the same everywhere."""
    parser.add_argument("-Y", dest="filter", metavar="FILTER", default="", help=f"{what} (show --help-fields)")


def add_help_fields(parser: argparse.ArgumentParser) -> None:
    """--help-fields: lists every field and ends."""
    parser.add_argument(
        "--help-fields",
        action=_HelpFields,
        nargs="?",
        metavar="PROTOCOL",
        help="list every field with its type and its words, and end",
    )


def filter_of_both(
    args: argparse.Namespace, capture: ReadSource, session: Session, devices: Devices | None = None
) -> tuple[SecondProof, Filter | None]:
    """What is known of a second protocol, and what -Y says, None without it, for those who list frames of one too.
    Where it asks for what frames of the first cannot have, the whole capture is looked at for a second one first."""
    from sniff.bus.second_proof import SecondProof

    proof = SecondProof(session)
    if not args.filter and not getattr(args, "explain", False):
        return proof, None
    from sniff.filter import FilterError, compile_filter
    from sniff.filter.errors import OfOthers, OfTimes

    try:
        compile_filter(args.filter, dissector_for(session), _scope(session, devices))
    except OfTimes:
        pass  # said below
    except OfOthers:
        from sniff.bus.second_protocol import proven

        proof = proven(capture, session, args.reference)
        if proof.name:
            session = replace(session, notes={**session.notes, SECOND_NOTE: proof.name})
    except FilterError:
        pass  # said below
    return proof, filter_of(args, capture, session, devices)


def filter_of(
    args: argparse.Namespace, capture: ReadSource, session: Session, devices: Devices | None = None
) -> Filter:
    """What -Y says, for a capture; ends with exit code 2 where it cannot be read, or asks for what frames of this
    protocol cannot have. Of several captures, one at least must have it."""
    from sniff.filter import FilterError, compile_filter
    from sniff.filter.errors import OfOthers

    dissector = dissector_for(session)
    scope = _scope(session, devices)
    try:
        return _compiled(args.filter, capture, session, scope)
    except OfOthers as error:
        if of_second(args, session, session.notes.get(SECOND_NOTE, "")) is not None:
            return compile_filter(args.filter, dissector, scope, others=True)
        refused = args.of_others = getattr(args, "of_others", frozenset()) | {id(capture)}
        if len(refused) >= arguments.captures_open():
            raise Failure(f"filter {args.filter!r}: {error}", USAGE) from None
        print(f"sniff485: {sanitized(session.port)}: {sanitized(error)}", file=sys.stderr)
        return compile_filter(args.filter, dissector, scope, others=True)
    except FilterError as error:
        raise Failure(f"filter {args.filter!r}: {error}", USAGE) from None


def of_second(args: argparse.Namespace, session: Session, name: str) -> Filter | None:
    """What -Y says of frames of a second protocol on the bus; None where it asks for what they cannot have."""
    from sniff.filter import FilterError, compile_filter

    if not registry.is_of_lines(name):
        return None
    try:
        return compile_filter(args.filter, registry.get(name), _scope(session))
    except FilterError:
        return None


def _scope(session: Session, devices: Devices | None = None) -> Scope:
    from sniff.filter import Scope

    return Scope(session.started, devices or Devices(), has_times=session.has_times)


def _compiled(text: str, capture: ReadSource, session: Session, scope: Scope) -> Filter:
    """The filter with all that it asks for beside the rows: findings, values of points, lines with devices in them."""
    from sniff.filter import compile_filter

    dissector = dissector_for(session)
    wanted = compile_filter(text, dissector, scope)
    if "finding" in wanted.names:
        scope = replace(scope, findings=evidence(capture, session, scope.devices))
    if wanted.points:
        from sniff.bus.asked_rows import points_told

        points = points_told(capture, session, scope.devices, wanted.points)
        scope = replace(scope, told=points.of, telling=points.telling)
    if "text" in wanted.names and scope.devices:
        from sniff.bus.asked_rows import lines_said

        scope = replace(scope, says=lines_said(capture, session, scope.devices))
    if wanted.by_request:
        from sniff.bus.asked_rows import fields_answered

        scope = replace(scope, answered=fields_answered(capture, session, wanted.by_request))
    again = wanted.points or wanted.by_request or wanted.names & {"finding", "text"}
    return compile_filter(text, dissector, scope) if again else wanted


def surveyed(
    args: argparse.Namespace,
    capture: ReadSource,
    session: Session,
    *observers: Observer,
    every_row: bool = False,
    devices: Devices | None = None,
) -> None:
    """Hand a capture to observers, as far as -Y accepts it; an exchange counts where one of its frames is accepted.

    `every_row`: all rows, and only the exchanges that are accepted."""
    if not args.filter:
        survey(Watched(capture), session, *observers, reference=args.reference)
        return
    from sniff.bus.sifting import sift

    sift(Watched(capture), session, filter_of(args, capture, session, devices), *observers, every_row=every_row)


def sifted(args: argparse.Namespace, capture: Capture, session: Session, devices: Devices | None = None) -> ReadSource:
    """The octets of the rows that -Y accepts; the capture itself without it."""
    if not args.filter:
        return capture
    from sniff.bus.sifting import Sifted

    return Sifted(capture, session, filter_of(args, capture, session, devices))


def is_empty(source: ReadSource) -> bool:
    """Whether it has no octets; reads to the first."""
    return all(isinstance(item, LineEvent) for item in source.blocks())


def shown_findings(
    args: argparse.Namespace,
    capture: Capture,
    session: Session,
    findings: tuple[Finding, ...],
    devices: Devices | None = None,
) -> tuple[Finding, ...]:
    """Findings with a row among their evidence that -Y accepts."""
    if not args.filter:
        return findings
    from sniff.bus.sifting import shown_findings as shown

    return shown(capture, session, filter_of(args, capture, session, devices), findings)


def evidence(capture: ReadSource, session: Session, devices: Devices) -> dict[int, frozenset[str]]:
    """Codes of the findings that each row is evidence of."""
    from sniff.analysis.judging import Judging

    judging = Judging(session, dissector_for(session), devices)
    with contextlib.suppress(CaptureError):  # who shows the rows says so
        survey(capture, session, judging)
    found: dict[int, frozenset[str]] = {}
    for finding in judging.findings():
        for no in finding.evidence:
            found[no] = found.get(no, frozenset()) | {finding.code}
    return found


class _HelpFields(argparse.Action):
    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        from sniff.cli.field_names import field_lines

        try:
            protocols = [registry.get(values)] if values else [*registry.usable(), *registry.relatives()]
        except registry.UnknownProtocol as error:
            raise Failure(str(error), USAGE) from None
        for line in field_lines(protocols):
            print(line)
        parser.exit()
