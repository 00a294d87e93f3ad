"""`taps`: two captures of one line, by its users' hands."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from dissectors.line import Timing
from sniff.cli import main
from sniff.engine.session import Session
from sniff.formats import create_of_items
from tests.bus_delivery import exact
from tests.sniff.taps.segment import Segment, bit_errors
from tests.sniff.taps.test_segment_faults import LINE


def written(folder: Path, segment: Segment) -> list[str]:
    paths = []
    for name, wire in zip(("near", "far"), segment.run(Timing(LINE), 400), strict=True):
        paths.append(str(folder / f"{name}.cap.txt"))
        with create_of_items(paths[-1], Session(name, LINE, "modbus-rtu")) as out:
            for chunk in exact(wire):
                out.write(chunk)
    return paths


def test_a_fault_is_said_with_its_side(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = written(tmp_path, Segment(onward=bit_errors(0.1)))
    assert main(["taps", *paths]) == 1
    out = capsys.readouterr().out
    assert "the fault lies between the taps, on the way from A to B" in out
    assert "± 1.1 ms" in out
    assert main(["taps", "--json", *paths]) == 1
    *senders, fault = map(json.loads, capsys.readouterr().out.splitlines())
    assert (fault["place"], fault["at"], fault["fault"]) == ("between", "B", "bits")
    assert senders[0]["sender"] == "master"
    assert {None, 1, 2, 3, 4} >= set(fault["senders"])
    assert main(["taps", "--reference", "--json", *paths]) == 1
    assert json.loads(capsys.readouterr().out.splitlines()[-1]) == fault


def test_nothing_is_said_of_a_clean_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["taps", *written(tmp_path, Segment())]) == 0
    assert "nothing is wrong between the taps" in capsys.readouterr().out


def test_two_lines_are_not_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    captures = Path(__file__).parents[3] / "captures"
    assert main(["taps", str(captures / "rtu-clean.cap.txt"), str(captures / "mstp-clean.cap.txt")]) == 2
    assert "not two taps on one line" in capsys.readouterr().err


def test_captures_of_different_days_have_nothing_in_common(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    near, far = written(tmp_path, Segment()), tmp_path / "later.cap.txt"
    far.write_text(Path(near[1]).read_text().replace("# start: 1970", "# start: 1999"))
    assert main(["taps", near[0], str(far)]) == 0
    assert "no frame was heard while both taps listened" in capsys.readouterr().out


@pytest.mark.parametrize("ahead", [-200, 200])
def test_two_clocks_that_differ_do_not_tell_where_somebody_stands(
    ahead: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All seem to stand behind the tap whose clock is behind; what is hit there would be that tap's own fault."""
    paths = written(tmp_path, Segment(onward=bit_errors(0.1), back=bit_errors(0.1)))
    for path, later in zip(map(Path, paths), (1000, 1000 + ahead), strict=True):
        lines = path.read_text().splitlines()
        first = next(place for place, line in enumerate(lines) if line.startswith("+"))
        delay, _, octets = lines[first].partition(" ")
        lines[first] = f"+{float(delay) + later:.6f} {octets}"
        path.write_text("\n".join(lines))
    assert main(["taps", *paths]) == 1
    out = capsys.readouterr().out
    assert "if one clock stamped both" in out
    assert "itself, its adapter" not in out
