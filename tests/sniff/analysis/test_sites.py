"""What several buses say together: each fault between buses is found, and innocent neighbours get nothing."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from dissectors.columns import Times
from dissectors.findings import Finding, Severity
from dissectors.frame import Chunk
from dissectors.line import MS
from dissectors.modbus.envelope import seal_rtu
from sniff.analysis import site_ear
from sniff.analysis.site_ear import MOST_FRAMES, SiteEar
from sniff.analysis.site_findings import SiteJudgement, judged
from sniff.analysis.site_rules import SITE_RULES
from sniff.bus.model import BusModel
from sniff.bus.offline import outputs, survey
from sniff.bus.site import site_bus
from sniff.cli import main
from sniff.engine.blocks import Block, blocks_of
from sniff.engine.engine import Output
from sniff.engine.event_texts import gone
from sniff.engine.follow_settings import dissector_for
from sniff.engine.session import Item, LineEvent, LineEventKind
from tests.seeds import seeds
from tests.sniff.analysis.sites_made import BASE, SITES, Site, sessions, write

CAPTURES = Path(__file__).parents[3] / "captures" / "sites"


class Given:
    """A capture in memory."""

    def __init__(self, items: list[Item]) -> None:
        self._items = items

    def items(self) -> Iterator[Item]:
        return iter(self._items)

    def blocks(self) -> Iterator[Block | LineEvent]:
        return blocks_of(self._items)


def judge(site: Site, latency: int = MS, reference: bool = False) -> SiteJudgement:
    """What is said of a site."""
    buses = []
    for session, items in zip(sessions(site), site.values(), strict=True):
        own = replace(session, adapter=replace(session.adapter, latency=latency))
        model, ear = BusModel(own, dissector_for(own), with_points=False), SiteEar()
        survey(Given(items), own, model, ear, reference=reference)
        buses.append(site_bus(model, ear))
    return judged(buses)


def codes(findings: tuple[Finding, ...]) -> tuple[str, ...]:
    return tuple(one.code for one in findings)


@pytest.mark.parametrize("name", SITES)
@pytest.mark.parametrize("seed", seeds(2))
def test_what_is_between_the_buses_is_found_and_nothing_else(name: str, seed: int) -> None:
    make, expected = SITES[name]
    assert codes(judge(make(random.Random(seed))).findings) == expected


@pytest.mark.parametrize("name", ["power-lost", "stations-lost", "hub-unplugged"])
def test_what_a_site_explains_stands_under_it(name: str) -> None:
    site = judge(SITES[name][0](random.Random(7)))
    (cause,) = site.findings
    for own in site.buses:
        assert any(one.cause == cause.key for one in own)
        assert all(one.severity < Severity.WARNING for one in own)


def test_what_had_been_explained_by_what_a_site_explains_stands_under_the_site() -> None:
    """All stations of a bus are lost at once: that explains each of them there, and the site explains that."""
    site = judge(SITES["stations-lost"][0](random.Random(7)))
    for own in site.buses:
        consequences = {one.key for one in own if one.cause is not None}
        assert consequences
        assert not consequences & {one.cause for one in own}


@pytest.mark.parametrize("name", ["one-bus-stops", "two-stops"])
def test_what_it_does_not_explain_stays_what_it_is(name: str) -> None:
    site = judge(SITES[name][0](random.Random(7)))
    assert any(one.severity is Severity.WARNING for own in site.buses for one in own)


@pytest.mark.parametrize("name", ["line-twice", "one-master", "twins"])
def test_adapters_that_hold_octets_back_prove_nothing(name: str) -> None:
    assert judge(SITES[name][0](random.Random(7)), latency=17 * MS).findings == ()


@pytest.mark.parametrize("name", ["gateway", "line-twice"])
def test_one_by_one_is_the_same(name: str) -> None:
    made = SITES[name][0](random.Random(5))
    assert judge(made) == judge(made, reference=True)


def test_what_happened_besides_stays_a_finding_of_its_bus() -> None:
    """A second silence of one bus alone is not explained by the first, of all."""
    site = SITES["power-lost"][0](random.Random(3))
    began = site["roof"][0].time
    site["roof"] = [item for item in site["roof"] if not 20 < (item.time - began) / 1e9 < 32]
    told = judge(site)
    assert codes(told.findings) == ("SB001",)
    (roof,) = [one for one in told.buses[1] if one.code == "LN304"]
    assert roof.severity is Severity.WARNING


def test_little_is_kept_of_a_long_capture() -> None:
    ear = SiteEar()
    ear._frames = MOST_FRAMES
    made = SITES["line-twice"][0](random.Random(1))
    session = sessions(made)[0]
    survey(Given(made["near"]), session, ear)
    assert len(ear.heard()) == 0


def test_as_much_is_kept_of_tables_as_of_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    made = SITES["line-twice"][0](random.Random(1))
    session, some = sessions(made)[0], made["near"][:200]
    for most, recent in ((50, 64), (200_000, 1)):
        monkeypatch.setattr(site_ear, "MOST_FRAMES", most)
        monkeypatch.setattr(site_ear, "_RECENT", recent)
        by_tables, by_rows = SiteEar(), SiteEar()
        survey(Given(some), session, by_tables)
        survey(Given(some), session, by_rows, reference=True)
        assert len(by_rows.heard()) <= most
        for one, other in zip(_kept(by_tables), _kept(by_rows), strict=True):
            assert one.tolist() == other.tolist()


def _kept(ear: SiteEar) -> list[Times]:
    heard, exchanges = ear.heard(), ear.exchanges()
    return [heard.start, heard.end, exchanges.asked, exchanges.answered]


def test_an_exchange_that_closes_after_its_answer_came_is_one() -> None:
    """A write and its confirmation are the same octets: which is which is known when somebody goes on."""
    session = sessions({"east": []})[0]
    chunks: list[Item] = []
    for pdu in ("020300000001", "0203020000", "020600030001", "020600030001", "020300000001", "0203020000"):
        chunks.append(Chunk((chunks[-1].time if chunks else BASE) + 50 * MS, seal_rtu(bytes.fromhex(pdu))))
    whole, apart = SiteEar(), SiteEar()
    survey(Given(chunks), session, whole)
    for output in outputs(chunks, session):
        if isinstance(output, Output):
            for row in output.rows:
                apart.add(Output((row,), ()))
            apart.add(Output((), output.transactions))
    assert len(whole.exchanges()) == 3
    assert whole.exchanges().answered.tolist() == apart.exchanges().answered.tolist()


def test_ports_that_were_never_there_did_not_go() -> None:
    """A box that is begun before its adapters are plugged in."""
    made = SITES["twins"][0](random.Random(1))
    for name, items in made.items():
        items.insert(0, LineEvent(BASE, LineEventKind.UNPLUGGED, gone(f"/dev/{name}", "no such port")))
        items.insert(1, LineEvent(BASE + 1, LineEventKind.REPLUGGED, f"/dev/{name} is back"))
    assert judge(made).findings == ()


def test_nothing_heard_at_all() -> None:
    assert judge({"east": [], "west": []}).findings == ()
    assert judge({"east": [Chunk(1, b"\x00")], "west": []}).findings == ()


@pytest.mark.parametrize("name", [name for name, (_, expected) in SITES.items() if expected])
def test_a_recording_of_a_site(name: str, tmp_path: Path, capsys, monkeypatch) -> None:
    write(tmp_path / f"{name}.mcap", SITES[name][0](random.Random(name)))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    main(["check", f"{name}.mcap", "--only", "SB,LN3,LN006"])
    assert capsys.readouterr().out == (CAPTURES / f"{name}.check.txt").read_text(encoding="utf-8")


def test_every_rule_has_a_recording() -> None:
    assert {one.code for one in SITE_RULES.values()} == {
        line.split("[")[1][:5]
        for path in CAPTURES.glob("*.check.txt")
        for line in path.read_text().splitlines()
        if "[SB" in line and not line.startswith(" ")
    }
