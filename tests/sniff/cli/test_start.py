"""What a command imports before it is at its work, and how its process ends: most of the time of a short one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CAPTURES = Path(__file__).parents[3] / "captures"

EVER = [
    "scapy",
    "textual",
    "mcap",
    "serial",
    "zstandard",
    "lz4",
    "polars",
    "numpy.random",
    "hashlib",
    "secrets",
    "ssl",
    "http",
    "email",
    "socket",
    "subprocess",
    "tempfile",
    "random",
    "statistics",
    "tomllib",
    "difflib",
    "importlib.metadata",
    "importlib.resources",
    "xml.sax",
    "traceback",
    "sniff.config",
    "sniff.devices",
    "sniff.outlet_settings",
    "sniff.capture",
    "sniff.recording",
    "sniff.sources",
    "sniff.bus.live",
    "sniff.bus.capture_writer",
    "sniff.bus.reading_process",
    "sniff.formats.unpacking",
    "sniff.formats.records",
    "sniff.formats.pcap",
    "sniff.formats.pcapng",
    "sniff.analysis.told_protocol",
    "sniff.analysis.point_reader",
    "sniff.analysis.points",
    "sniff.analysis.polls",
    "sniff.analysis.register_series",
    "sniff.analysis.profile_findings",
    "sniff.analysis.site_ear",
    "sniff.analysis.site_findings",
    "sniff.filter",
    "sniff.cli.check_junit",
    "sniff.cli.targets",
    "dissectors.meaning",
    "dissectors.profiles.model",
    "dissectors.profiles.packaged",
    "dissectors.profiles.parsing",
    "dissectors.plugin_guard",
    "dissectors.simulated",
    "dissectors.modbus.tcp",
    "dissectors.bacnet.ip",
    "dissectors.bacnet.renamer",
    "dissectors.n2",
    "dissectors.profibus",
]
"""What no command needs that reads a capture which says its protocol and holds no device, whole and of one protocol."""

JUDGING = [
    "sniff.bus.model",
    "sniff.analysis.judging",
    "sniff.analysis.line_findings",
    "sniff.analysis.other_settings",
    "dissectors.bacnet.ring",
    "dissectors.bacnet.findings",
    "dissectors.modbus.observer",
]
"""What judges, which `check` alone does."""

COLUMNS = ["sniff.cli.row_cells", "sniff.cli.row_columns", "sniff.analysis.row_tree"]


def imported(arguments: list[str], *modules: str) -> list[str]:
    """Those of the modules that a command has imported when it ends."""
    code = (
        "import sys\nfrom sniff.cli import main\n"
        "try: main(sys.argv[2:])\nexcept SystemExit: pass\n"
        "print()\nprint(*(name for name in sys.argv[1].split() if name in sys.modules))"
    )
    command = [sys.executable, "-c", code, " ".join(modules), *arguments]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert len(ran.stdout.splitlines()) > 2 or "--version" in arguments, ran.stderr  # it did what it was asked for
    return ran.stdout.splitlines()[-1].split()


def test_version_loads_nothing_of_captures_and_protocols() -> None:
    heavy = ["numpy", "dataclasses", "pathlib", "json", "dissectors.manifest", "dissectors.frame", "sniff.formats"]
    assert imported(["--version"], *EVER, *heavy, "sniff.engine.session", "sniff.cli.info") == []


@pytest.mark.parametrize(
    ("command", "capture", "others"),
    [
        ("info", "rtu", ["dissectors.bacnet", *JUDGING, "csv", "threading", "signal"]),
        ("info", "mstp", ["dissectors.modbus", *JUDGING, "csv", "threading", "signal"]),
        ("stats", "mstp", ["dissectors.modbus", *JUDGING]),
        ("show", "mstp", ["dissectors.modbus", *JUDGING, *COLUMNS]),
        ("check", "mstp", ["dissectors.modbus", *COLUMNS]),
        ("check", "rtu", ["dissectors.bacnet", *COLUMNS]),
    ],
)
def test_a_short_command_imports_what_it_uses(command: str, capture: str, others: list[str]) -> None:
    assert imported([command, str(CAPTURES / f"{capture}-clean.cap.txt")], *EVER, *others) == []


def test_what_is_not_asked_for_exists() -> None:
    """A module that was renamed would be missed by none of these tests."""
    from importlib.util import find_spec

    ours = [name for name in (*EVER, *JUDGING, *COLUMNS) if name.startswith(("sniff.", "dissectors."))]
    assert [name for name in ours if find_spec(name) is None] == []


def test_a_process_gives_code_and_output_and_looks_for_no_circles_at_its_end() -> None:
    """One circle of the command's own, with a finaliser that would say so, is left at the end."""
    code = (
        "import gc, sys\nfrom sniff.cli import process\n"
        "class Circle:\n"
        "    def __init__(self): self.own = self\n"
        "    def __del__(self): print('looked for')\n"
        "def main():\n"
        "    Circle(); print('done', gc.get_threshold()[0] == process.MADE, gc.isenabled()); return 4\n"
        "process.main = main\nsys.exit(process.run())"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (4, "done True True\n", "")


def test_both_ways_to_start_it_are_the_same_process() -> None:
    import tomllib

    root = Path(__file__).parents[3]
    script = tomllib.loads((root / "pyproject.toml").read_text())["project"]["scripts"]["sniff485"]
    assert script == "sniff.cli.process:run"
    assert "from sniff.cli.process import run" in (root / "sniff/__main__.py").read_text()
