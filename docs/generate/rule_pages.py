"""Pages of all rules: what each measures, and a capture that shows it, with its picture."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from dissectors.findings import Rule
from docs.generate.markdown import anchored, table, told
from docs.generate.running import json_lines
from docs.generate.wire_picture import wire_picture

CAPTURES = Path(__file__).parents[2] / "captures"
ROWS_BEFORE, ROWS_SHOWN = 3, 9


@dataclass(frozen=True, slots=True)
class Family:
    """Rules of one page: their codes begin alike."""

    begin: str
    title: str
    rules: list[Rule] = field(default_factory=list)


def families() -> list[Family]:
    """All rules by the two letters that they begin with, as the catalogues have them."""
    from dissectors import registry
    from sniff.analysis.judging import all_rules
    from sniff.analysis.line_rules import LINE_RULES
    from sniff.analysis.profile_rules import PROFILE_RULES
    from sniff.analysis.site_rules import SITE_RULES

    titles: dict[str, list[str]] = {}
    titled = [("The line", LINE_RULES), ("Device profiles", PROFILE_RULES), ("Several buses", SITE_RULES)]
    titled += [(one.title, one.rules) for one in map(registry.get, registry.BUILT_IN)]
    for title, rules in titled:
        for begin in {code[:2] for code in rules}:
            titles.setdefault(begin, []).append(title)
    made = {begin: Family(begin, " and ".join(names)) for begin, names in titles.items()}
    for code, rule in sorted(all_rules().items()):
        if code[:2] in made:
            made[code[:2]].rules.append(rule)
    return list(made.values())


def rule_pages() -> Iterator[tuple[str, str]]:
    """Page addresses and their Markdown."""
    every = families()
    yield "reference/rules/index.md", _index(every)
    for family in every:
        yield f"reference/rules/{family.begin.lower()}.md", _page(family)


def page_of(code: str) -> str:
    """The address of a rule, from another page of rules."""
    return f"{code[:2].lower()}.md#{code.lower()}"


def _index(every: list[Family]) -> str:
    lines = [
        "# Rules",
        "",
        "What `sniff485 check` and the Findings screen can say. The code says whose rule it is; `sniff485 rule CODE` "
        "says in the terminal what stands here.",
    ]
    for family in every:
        rows = [(f"[{one.code}]({page_of(one.code)})", one.severity.label, told(one.title)) for one in family.rules]
        lines += ["", f"## {family.title}", "", *table(("code", "severity", "title"), rows)]
    return "\n".join(lines) + "\n"


def _page(family: Family) -> str:
    lines = [
        f"# Rules: {family.title}",
        "",
        "In the pictures a box is a frame and as wide as it has octets; pauses are written between them and are not to "
        "scale. ▲ marks evidence of the finding. All captures are this project's own, in `captures/`.",
    ]
    for rule in family.rules:
        lines += ["", *anchored(2, f"{rule.code} {rule.title}", rule.code.lower()), "", *_explained(rule)]
        lines += _shown(rule.code)
    return "\n".join(lines) + "\n"


def _explained(rule: Rule) -> Iterator[str]:
    yield f"*{rule.severity.label} unless said otherwise*"
    yield ""
    yield told(rule.explanation)
    for word, text in (("Consistent with", rule.means), ("Check next", rule.next)):
        if text:
            yield from ("", f"**{word}:** {told(text)}.")
    if rule.explains:
        yield from ("", f"**Explains,** where it is a warning or an error: {_links(rule.explains)}.")
    if rule.explains_there:
        yield from ("", f"**Explains,** where it stands in the same frames: {_links(rule.explains_there)}.")
    if rule.told_by:
        yield from ("", f"**Told by,** where one of them speaks of the same: {_links(rule.told_by)}.")


def _links(codes: tuple[str, ...]) -> str:
    return ", ".join(f"[{code}]({page_of(code)})" if len(code) == 5 else f"{code}…" for code in dict.fromkeys(codes))


def _shown(code: str) -> Iterator[str]:
    """A capture that shows a rule."""
    from sniff.analysis.judging import all_rules

    found = _example(code)
    if found is None:
        return
    name, finding = found
    yield from ("", f"Seen in `{name}`:", "", "```text")
    yield f"{finding['severity'].upper():<8} {finding['subject']}: {finding['title']}  [{code}]"
    for begin, said in (("", _sentence(finding["seen"])), ("means: ", finding["means"]), ("next:  ", finding["next"])):
        yield from textwrap.wrap(said, 84, initial_indent=f"         {begin}", subsequent_indent=" " * (9 + len(begin)))
    yield "```"
    evidence = {one["no"] for one in finding["frames"]}
    rows = _rows(name)
    at = next((place for place, row in enumerate(rows) if row["no"] in evidence), None)
    if at is None:
        return
    some = rows[max(0, at - ROWS_BEFORE) :][:ROWS_SHOWN]
    title = f"{code} {all_rules()[code].title}: frames {some[0]['no']} to {some[-1]['no']} of {name}"
    yield from ("", f'<figure class="wire" markdown="0">{wire_picture(some, evidence, title)}</figure>')
    yield from ("", "```text")
    for row in some:
        latency = f"  [{row['latency_ms']} ms]" if row["role"] == "response" and row["latency_ms"] is not None else ""
        flag = "▲" if row["no"] in evidence else " "
        verdict = "" if row["verdict"] in (None, "answered", "data") else f"  {row['verdict']}"
        yield f"{flag}{row['no']:>5} {row['start_ns'] / 1e9:11.6f} s  {row['text'][:90]}{latency}{verdict}"
    yield "```"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + "."


@cache
def _readings() -> list[tuple[str, str]]:
    """Captures with their expected readings, the shortest first."""
    found = [(_capture_of(path), path.read_text(encoding="utf-8")) for path in CAPTURES.rglob("*.expect.txt")]
    found.sort(key=lambda one: (len(one[1]), one[0]))
    return [(str(path.relative_to(CAPTURES.parent)), text) for path, text in found]


@cache
def _example(code: str) -> tuple[str, dict[str, Any]] | None:
    """The shortest capture whose expected reading has this finding, and that finding as `check` says it."""
    from sniff.analysis.judging import all_rules

    usual = all_rules()[code].severity.label
    candidates = [
        name for name, text in _readings() if re.search(rf"\b{code}\b", text.partition("[findings]")[2] or text)
    ]
    found = [(name, one) for name in candidates[:6] for one in _findings(name) if one["code"] == code]
    found.sort(key=lambda one: (one[1]["severity"] != usual, not one[1]["frames"]))
    return found[0] if found else None


@cache
def _findings(capture: str) -> list[dict[str, Any]]:
    return json_lines(["check", "--json", "--fail-on", "never", str(CAPTURES.parent / capture)])


@cache
def _rows(capture: str) -> list[dict[str, Any]]:
    return json_lines(["show", "--json", str(CAPTURES.parent / capture)])


def _capture_of(expectation: Path) -> Path:
    """What an expectation stands beside."""
    name = expectation.name.removesuffix(".expect.txt")
    beside = [one for one in expectation.parent.glob(f"{name}.*") if not one.name.endswith(".expect.txt")]
    return min(beside, key=lambda one: (not one.name.endswith(".cap.txt"), one.name))
