"""Without CODE: all rules: of every protocol, LN… of the line, PR… of device profiles."""

from __future__ import annotations

import argparse
import textwrap

from dissectors.findings import Rule
from sniff.analysis.json_text import dumps
from sniff.analysis.judging import all_rules
from sniff.cli import USAGE, Failure, tables

WIDTH = 88


def configure(parser: argparse.ArgumentParser) -> None:
    """Options of `rule`."""
    parser.add_argument("codes", nargs="*", metavar="CODE", help="a code, or a prefix such as MB1")
    parser.add_argument("--json", action="store_true", help="one JSON object a rule")


def run(args: argparse.Namespace) -> int:
    """Explain rules, or list them."""
    rules = all_rules()
    chosen = dict(sorted(rules.items()))
    if args.codes:
        prefixes = tuple(code.strip().upper() for code in args.codes)
        chosen = {code: rule for code, rule in chosen.items() if code.startswith(prefixes)}
        missing = [prefix for prefix in prefixes if not any(code.startswith(prefix) for code in chosen)]
        if missing:
            raise Failure(f"{missing[0]}: no rule has that code or prefix; `sniff485 rule` lists them", USAGE)
    if args.json:
        for rule in chosen.values():
            print(dumps(to_json(rule)))
    elif not args.codes:
        tables.write(("code", "severity", "title"), [(r.code, r.severity.label, r.title) for r in chosen.values()])
    else:
        print("\n\n".join(_explained(rule) for rule in chosen.values()))
    return 0


def to_json(rule: Rule) -> dict[str, str | list[str]]:
    """A rule as an object."""
    return {
        "code": rule.code,
        "severity": rule.severity.label,
        "title": rule.title,
        "explanation": rule.explanation,
        "means": rule.means,
        "next": rule.next,
        "explains": list(dict.fromkeys(rule.explains)),
        "explains_there": list(rule.explains_there),
        "told_by": list(rule.told_by),
    }


def _explained(rule: Rule) -> str:
    lines = [f"{rule.code}  {rule.title}  ({rule.severity.label} unless said otherwise)", ""]
    lines += textwrap.wrap(rule.explanation, WIDTH)
    explained = dict.fromkeys(rule.explains)  # a code may come of several kinds of trouble that it explains
    explains = f"{', '.join(map(_codes, explained))}, where it is a warning or an error" if explained else ""
    if rule.explains_there:
        explains += "; " if explains else ""
        explains += f"{', '.join(map(_codes, rule.explains_there))} in the same frames"
    told_by = f"{', '.join(map(_codes, rule.told_by))}, where one of them speaks of the same" if rule.told_by else ""
    parts = (("consistent with", rule.means), ("check next", rule.next), ("explains", explains), ("told by", told_by))
    for word, text in parts:
        if text:
            head = f"{word}: "
            lines += ["", *textwrap.wrap(head + text, WIDTH, subsequent_indent=" " * len(head))]
    return "\n".join(lines)


def _codes(begin: str) -> str:
    """A code, or the begin of several: "MB005", "LN2…"."""
    return begin if begin in all_rules() else f"{begin}…"
