"""Pages made from the code: every command, rule and field is on one."""

from __future__ import annotations

from dissectors import registry
from docs.generate import rule_pages
from docs.generate.command_pages import command_pages
from docs.generate.field_pages import field_pages
from docs.generate.wire_picture import wire_picture
from sniff.analysis.judging import all_rules
from sniff.cli import COMMANDS
from sniff.filter.fields import types_of


def test_every_command_has_a_page() -> None:
    pages = dict(command_pages())
    assert {f"reference/commands/{name}.md" for name in COMMANDS} <= set(pages)
    assert "<code>--fail-on SEVERITY</code>" in pages["reference/commands/check.md"]
    assert "sniff485 profile draft" in pages["reference/commands/profile.md"]


def test_every_field_is_on_a_page() -> None:
    text = "".join(text for _, text in field_pages()).replace("&#95;", "_")
    for name in registry.BUILT_IN:
        assert all(f"<code>{field}</code>" in text for field in types_of(registry.get(name)))


def test_every_rule_is_on_the_page_of_its_family() -> None:
    families = rule_pages.families()
    assert sorted(rule.code for family in families for rule in family.rules) == sorted(all_rules())
    assert all(
        rule_pages.page_of(rule.code).startswith(family.begin.lower()) for family in families for rule in family.rules
    )


def test_a_rule_is_shown_with_a_capture_its_picture_and_its_evidence() -> None:
    shown = "\n".join(rule_pages._shown("PR010"))
    assert "Seen in `captures/findings/" in shown
    assert "[PR010]" in shown
    assert shown.count('class="ev"') == shown.count("\n▲") > 0


def test_a_picture_says_what_is_a_frame_and_what_is_none() -> None:
    row = {"no": 1, "start_ns": 0, "end_ns": 10, "proto": "n2", "ok": True, "role": "request", "hex": "00", "src": None}
    noise = {**row, "no": 2, "start_ns": 20_000_010, "end_ns": 20_000_020, "proto": None, "ok": False, "hex": "ffff"}
    picture = wire_picture([{**row, "dst": 7}, noise], {2}, "<a>")
    assert "7 ←" in picture
    assert ">20 ms<" in picture
    assert ">noise<" in picture
    assert "<title>&lt;a&gt;</title>" in picture
