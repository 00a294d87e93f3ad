"""The page: stands alone, escapes what the wire said, says what the JSON says, and a browser shows it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sniff.cli import main
from sniff.reporting.numbers import CaptureNumbers
from sniff.reporting.page import page
from tests.sniff.reporting.page_reading import CAPTURES, SCRIPT, Page

pytest.importorskip("matplotlib", reason="needs sniff485[report]")
pytest.importorskip("jinja2", reason="needs sniff485[report]")

EACH = ("rtu-usual-faults", "n2-usual-faults", "mstp-usual-faults", "ascii-noisy-ftdi")
CHROMIUM = "/usr/bin/chromium"


@pytest.fixture(scope="module", params=EACH)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    out = tmp_path_factory.mktemp("report") / "out.html"
    assert main(["report", str(CAPTURES / f"{request.param}.cap.txt"), "-o", str(out)]) == 0
    return request.param, out


def test_the_verdict_comes_first(made: tuple[str, Path], numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    name, out = made
    text = Page(out.read_text("utf-8")).text
    numbers = numbers_of(CAPTURES / f"{name}.cap.txt")
    places = [text.index(word) for word in (numbers.verdict, "Findings", "Stations", "Load and errors", "How it was")]
    assert places == sorted(places)
    assert ("Token ring" in text) == name.startswith("mstp")
    assert "None" not in text.replace("None.", "").replace("None was heard", "")


def test_every_number_of_the_json_is_on_the_page(made: tuple[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    name, out = made
    assert main(["report", "--json", str(CAPTURES / f"{name}.cap.txt")]) == 0
    numbers = json.loads(capsys.readouterr().out)
    text = Page(out.read_text("utf-8")).text.replace("\u202f", "")
    assert f"{numbers['frames']} frames, {numbers['damaged']} damaged" in text
    assert f"{numbers['octets']} octets, {numbers['noise_octets']} of them noise" in text
    assert f"bus load {numbers['load']:.1%}" in text
    assert f"{numbers['health']['score']} health, of 100" in text
    for finding in numbers["findings"]:
        assert finding["seen"][1:] in text
        if finding["severity"] != "info":
            assert finding["next"] in text
            assert all(f"row {evidence['no']} at" in text for evidence in finding["evidence"])
    for station in numbers["stations"]:
        if station["health"] is None:  # only looked for
            continue
        row = (station["address"], station["health"]["score"], station["sent"], station["received"], station["asked"])
        assert " ".join(map(str, row)) in text
    for limit in numbers["measurement"]["limits"]:
        assert limit in text


def test_nothing_is_fetched_from_anywhere(made: tuple[str, Path]) -> None:
    html = made[1].read_text("utf-8")
    page = Page(html)
    assert not page.tags("script")
    assert not [tag for tag, _ in page.elements if tag in ("link", "iframe", "object", "embed", "img", "image", "base")]
    for _, attributes in page.elements:
        assert not [key for key in attributes if key.startswith("on")]
        for key in ("src", "href", "xlink:href", "action", "data", "poster", "srcset"):
            assert (attributes.get(key) or "#").startswith("#"), attributes
        assert "://" not in (attributes.get("style") or "")
    styles = re.findall(r"<style.*?</style>", html, re.DOTALL)
    assert styles
    assert not re.search(r"@import|url\((?!#)", "".join(styles))
    assert not re.search(r"url\((?!#)", html)


def test_ids_are_unique_and_references_lead_somewhere(made: tuple[str, Path]) -> None:
    page = Page(made[1].read_text("utf-8"))
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    wanted = {attributes["xlink:href"] for _, attributes in page.elements if "xlink:href" in attributes}
    wanted |= set(re.findall(r"url\((#[^)]*)\)", page.html))
    assert wanted
    assert {reference and reference[1:] for reference in wanted} <= set(ids)


def test_pictures_are_there(made: tuple[str, Path]) -> None:
    page = made[1].read_text("utf-8")
    values = "Values over time" in page
    assert len(Page(page).tags("svg")) == (3 if made[0].startswith("mstp") else 2) + values
    assert values or not made[0].startswith("rtu")


def test_what_the_wire_says_is_text(hostile: Path, tmp_path: Path) -> None:
    out = tmp_path / "page.html"
    assert main(["report", str(hostile), "-o", str(out)]) == 0
    html = out.read_text("utf-8")
    page = Page(html)
    assert not page.tags("script")
    assert not page.tags("i")
    assert SCRIPT not in html
    shown = page.text.count("alert(1)")
    assert shown >= 3, "the server's words, the port's name and the note are all on the page"
    evidence = re.search(r"row \d+ at [\d.]+ s: 1 → [^:]*", page.text)
    assert evidence is not None


def test_several_captures_on_one_page(tmp_path: Path) -> None:
    out = tmp_path / "both.html"
    files = [str(CAPTURES / f"{name}.cap.txt") for name in ("n2-clean", "rtu-clean")]
    assert main(["report", *files, "-o", str(out)]) == 0
    page = Page(out.read_text("utf-8"))
    assert len(page.tags("section")) == 2
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))


def test_the_page_stands_beside_its_capture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    capture = tmp_path / "night.cap.txt"
    shutil.copy(CAPTURES / "n2-clean.cap.txt", capture)
    assert main(["report", str(capture)]) == 0
    assert str(tmp_path / "night.html") in capsys.readouterr().err
    assert (tmp_path / "night.html").exists()
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert main(["report", str(capture)]) == 0
    assert (here / "night.html").exists()


def test_a_capture_is_never_overwritten(tmp_path: Path) -> None:
    capture = tmp_path / "night.cap.txt"
    shutil.copy(CAPTURES / "n2-clean.cap.txt", capture)
    before = capture.read_bytes()
    assert main(["report", str(capture), "-o", str(capture)]) == 2
    assert capture.read_bytes() == before


def test_what_is_no_page_is_overwritten_only_by_force(tmp_path: Path) -> None:
    capture, other = CAPTURES / "n2-clean.cap.txt", tmp_path / "other.mcap"
    other.write_bytes(b"a recording")
    assert main(["report", str(capture), "-o", str(other)]) == 2
    assert other.read_bytes() == b"a recording"
    assert main(["report", str(capture), "-f", "-o", str(other)]) == 0
    assert main(["report", str(capture), "-o", str(other)]) == 0  # a page by now


def test_an_empty_capture_has_a_page(tmp_path: Path) -> None:
    capture = tmp_path / "empty.cap.txt"
    capture.write_text("#!sniff-capture 1\n# line: 9600,8N1\n# protocol: n2\n# start: 2026-03-01T10:00:00Z\n")
    assert main(["report", str(capture)]) == 0
    page = Page((tmp_path / "empty.html").read_text("utf-8"))
    assert "Nothing was heard" in page.text
    assert not page.tags("svg")


@pytest.mark.parametrize("absent", ["matplotlib", "jinja2"])
def test_without_its_libraries_it_says_what_to_install(absent: str, tmp_path: Path) -> None:
    """In a process of its own, in which the library cannot be found."""
    program = (
        "import sys, importlib.util\n"
        "find = importlib.util.find_spec\n"
        f"importlib.util.find_spec = lambda name, *rest: None if name == {absent!r} else find(name, *rest)\n"
        "from sniff.cli import main\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    command = [sys.executable, "-c", program, "report", str(CAPTURES / "n2-clean.cap.txt")]
    ran = subprocess.run([*command, "-o", str(tmp_path / "x.html")], capture_output=True, text=True, check=False)
    assert ran.returncode == 2
    assert ran.stderr == f"sniff485: report needs {absent}: pip install 'sniff485[report]'\n"
    assert subprocess.run([*command, "--json"], capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not Path(CHROMIUM).exists(), reason="no Chromium here")
def test_a_browser_shows_it_without_errors(tmp_path: Path, numbers_of: Callable[[Path], CaptureNumbers]) -> None:
    """The ring's page: it has every section that there is."""
    capture, out = CAPTURES / "mstp-usual-faults.cap.txt", tmp_path / "page.html"
    assert main(["report", str(capture), "-o", str(out)]) == 0
    ran = subprocess.run(
        [
            CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            f"--user-data-dir={tmp_path / 'profile'}", "--enable-logging=stderr", "--v=0", "--dump-dom", out.as_uri(),
        ],
        capture_output=True, text=True, timeout=100, check=True,
    )  # fmt: skip
    assert not [line for line in ran.stderr.splitlines() if ":CONSOLE" in line]
    page = Page(ran.stdout)
    numbers = numbers_of(capture)
    assert numbers.verdict in page.text
    assert all(finding.seen[1:] in page.text for finding in numbers.findings)
    assert len(page.tags("svg")) == len(Page(out.read_text("utf-8")).tags("svg"))


def test_each_protocol_has_its_word_for_a_place_on_the_bus(made: tuple[str, Path]) -> None:
    name, out = made
    text = Page(out.read_text("utf-8")).text
    assert ("MAC health frames from" in text) == name.startswith("mstp")
    assert ("station health frames from" in text) != name.startswith("mstp")
    assert "no-response" not in text
    assert "damaged-answer" not in text


def test_a_row_of_many_words_keeps_its_begin_and_what_is_wrong_with_it(
    numbers_of: Callable[[Path], CaptureNumbers],
) -> None:
    found = numbers_of(CAPTURES / "findings" / "n2-two-masters.cap.txt").findings
    rows = [evidence.text for finding in found for evidence in finding.evidence]
    cut = [text for text in rows if " … " in text]
    assert cut
    assert all(text.startswith("A → ") and text.endswith("expected]") for text in cut)
    assert max(len(text) for text in rows) <= 180


def test_what_is_not_listed_is_counted(
    monkeypatch: pytest.MonkeyPatch, hostile: Path, numbers_of: Callable[[Path], CaptureNumbers]
) -> None:
    monkeypatch.setattr("sniff.reporting.happenings.HAPPENINGS_SHOWN", 1)
    hostile.write_text(hostile.read_text() + "#! +6 note two\n#! +7 note three\n")
    numbers = numbers_of(hostile)
    assert (len(numbers.happenings), numbers.happenings_left_out) == (1, 2)
    assert "Those are the first 1; 2 more came later." in Page(page([numbers])).text
