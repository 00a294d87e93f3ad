"""Pages made from the code: every command, rule and field is on one."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from dissectors import registry
from docs.generate import rule_pages
from docs.generate.command_pages import command_pages
from docs.generate.field_pages import field_pages
from docs.generate.wire_picture import wire_picture
from sniff.analysis.judging import all_rules
from sniff.cli import COMMANDS
from sniff.config import ALERT_KEYS, BOX_KEYS, BUS_KEYS, TOP_KEYS, VIEW_KEYS
from sniff.filter.fields import types_of
from sniff.outlet_settings import FILE_KEYS, LISTEN_KEYS, MQTT_KEYS
from sniff.tui.app import SnifferApp
from sniff.tui.key_names import KNOWN
from sniff.tui.screens import SCREENS, load

PAGES = Path(__file__).parents[2] / "docs" / "pages"


def test_every_command_has_a_page() -> None:
    pages = dict(command_pages())
    assert {f"reference/commands/{name}.md" for name in COMMANDS} <= set(pages)
    assert "<code>--fail-on SEVERITY</code>" in pages["reference/commands/check.md"]
    assert "sniff485 profile draft" in pages["reference/commands/profile.md"]


def test_every_table_and_key_of_the_configuration_is_explained() -> None:
    text = (PAGES / "configuration.md").read_text("utf-8")
    tables: dict[str, set[str]] = {name: set() for name in TOP_KEYS} | {
        "bus": {*BUS_KEYS}, "box": {*BOX_KEYS}, "alert": {*ALERT_KEYS}, "view": {*VIEW_KEYS}, "mqtt": {*MQTT_KEYS},
        "influx": {*FILE_KEYS}, "metrics": {*LISTEN_KEYS},
    }  # fmt: skip
    for table, keys in tables.items():
        assert re.search(rf"\[{table}[].]", text), table
        for key in keys:
            assert f"`{key}`" in text or re.search(rf"^{key} = |`{key} = ", text, re.M), f"{table}: {key}"


def test_every_extra_is_explained() -> None:
    told = tomllib.loads((PAGES.parents[1] / "pyproject.toml").read_text("utf-8"))
    text = (PAGES / "install.md").read_text("utf-8")
    extras = set(told["project"]["optional-dependencies"]) - {"docs", "test"}  # for developers
    assert {name for name in extras if not re.search(rf"^\| [^|]*`{name}`[^|]* \|", text, re.M)} == set()


def test_keys_that_are_named_are_there() -> None:
    text = (PAGES / "screens.md").read_text("utf-8").partition("| name | does |")[2]
    for entry in SCREENS:
        load(entry)
    named = {name for line in text.splitlines() if "|" in line for name in re.findall(r"`([\w-]+)`", line)}
    assert SnifferApp.BINDINGS
    assert len(named) > 30
    assert named <= KNOWN


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
    assert "Seen in `captures/" in shown
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
