"""The output of `check` for build servers: JUnit XML. What escapes XML imports half of the web, so it is apart."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from xml.sax.saxutils import escape, quoteattr

from dissectors.findings import Finding, Severity
from sniff.analysis.sanitizing import sanitized
from sniff.analysis.site_rules import SITE
from sniff.cli.check_output import Checked, evidence, failures, rules_of, sentence


def write_junit(checked: Sequence[Checked], fail_on: Severity) -> None:
    """Print one test suite a source, one test case a rule: it fails when a finding of it is at or above `fail_on`, but
    for the consequences of another finding, which stand in the text of their cause too."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<testsuites name="sniff485 check">']
    for one in checked:
        lines += _suite(one, fail_on)
    lines.append("</testsuites>")
    sys.stdout.write("\n".join(lines) + "\n")


def _suite(one: Checked, fail_on: Severity) -> list[str]:
    rules, kind = rules_of(one), SITE if one.buses else one.session.protocol
    failing = {finding.code for finding in failures(one.findings, fail_on)}
    head = (
        f"  <testsuite name={_attribute(one.source)} tests={_attribute(str(len(rules)))} "
        f'failures={_attribute(str(len(failing)))} errors="0" time={_attribute(f"{one.seconds:.3f}")}>'
    )
    lines = [head]
    for code, rule in sorted(rules.items()):
        found = [finding for finding in one.findings if finding.code == code]
        case = f"    <testcase classname={_attribute(kind)} name={_attribute(f'{code} {rule.title}')}"
        if not found:
            lines.append(case + "/>")
            continue
        lines.append(case + ">")
        bad = failures(one.findings, fail_on, code)
        if bad:
            text = "\n".join(_junit_text(one, finding) for finding in bad)
            lines.append(
                f"      <failure message={_attribute(f'{bad[0].subject}: {bad[0].seen}')} "
                f"type={_attribute(bad[0].severity.label)}>{escape(_clean(text))}</failure>"
            )
        else:
            text = "\n".join(_junit_text(one, finding) for finding in found)
            lines.append(f"      <system-out>{escape(_clean(text))}</system-out>")
        lines.append("    </testcase>")
    return [*lines, "  </testsuite>"]


def _junit_text(one: Checked, finding: Finding) -> str:
    behind = f"\n{evidence(one, finding)}" if finding.evidence else ""
    head = f"{finding.severity.label}: {finding.subject}: {sentence(finding.seen)}"
    explained = "".join(
        f"\nexplains {other.code} {other.subject}: {sentence(other.seen)}"
        for other in one.findings
        if other.cause == finding.key
    )
    return f"{head}\nmeans: {finding.means}\nnext: {finding.next}{behind}{explained}"


def _attribute(text: str) -> str:
    return quoteattr(_clean(text))


def _clean(text: str) -> str:
    """Without characters that XML 1.0 does not allow, or that a terminal obeys."""
    return "\n".join(map(sanitized, text.split("\n")))
