"""Manual pages and completion are made from the command line: every command and option is in them."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.generate.commands import Command, all_commands
from docs.generate.completion import completions
from docs.generate.manual import escaped, manual_pages
from sniff.cli import COMMANDS, main
from sniff.cli.completion import SCRIPTS


def test_every_command_and_option_has_its_place_in_a_manual_page() -> None:
    pages = manual_pages()
    assert set(pages) == {"sniff485.1"} | {f"sniff485-{name}.1" for name in COMMANDS}
    for command in all_commands().parts:
        page = pages[f"sniff485-{command.words[0]}.1"]
        for one in (command, *command.parts):
            for group in one.groups:
                for argument in group.arguments:
                    assert escaped(argument.written) in page, (command.name, argument.written)


def test_defaults_are_said_alike() -> None:
    def said(command: Command) -> Iterator[str]:
        for group in command.groups:
            yield from (one.says for one in group.arguments)
        for part in command.parts:
            yield from said(part)

    assert [text for text in said(all_commands()) if re.search(r"(^|\(|; )default ", text)] == []


@pytest.mark.skipif(shutil.which("groff") is None, reason="no groff here")
def test_troff_takes_the_manual_pages_without_a_warning(tmp_path: Path) -> None:
    for name, text in manual_pages().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    said = subprocess.run(
        ["groff", "-man", "-ww", "-Tutf8", "-z", "-Kutf8", *sorted(map(str, tmp_path.iterdir()))],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert [line for line in said.stderr.splitlines() if "break" not in line and "adjust" not in line] == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes_commands_options_and_words() -> None:
    script = completions()[SCRIPTS["bash"]]
    ask = """
        complete_() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); COMP_LINE="$*"; COMP_POINT=${#COMP_LINE}
            $(complete -p sniff485 | sed 's/.*-F \\([^ ]*\\).*/\\1/'); printf '%s ' "${COMPREPLY[@]}"; echo; }
        complete_ sniff485 sho
        complete_ sniff485 check --fai
        complete_ sniff485 show -p mod
        complete_ sniff485 rule MB00
    """
    said = subprocess.run(["bash", "-c", f"{script}\n{ask}"], capture_output=True, text=True, check=True)
    commands, option, protocols, codes = said.stdout.splitlines()
    assert commands.split() == ["show"]
    assert option.split() == ["--fail-on"]
    assert protocols.split() == ["modbus-rtu", "modbus-ascii"]
    assert {"MB001", "MB002"} <= set(codes.split())


def test_the_command_prints_what_was_installed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sysconfig.get_path", lambda *of: str(tmp_path))
    assert main(["completion", "fish"]) == 3
    assert "install it with pip" in capsys.readouterr().err
    script = tmp_path / SCRIPTS["fish"]
    script.parent.mkdir(parents=True)
    script.write_text("complete -c sniff485\n")
    assert main(["completion", "fish"]) == 0
    assert capsys.readouterr().out == "complete -c sniff485\n"


def test_the_command_line_needs_no_more_than_the_build_has() -> None:
    """The wheel is built where only these are installed, beside shtab."""
    code = (
        "import sys; from docs.generate.manual import manual_pages; manual_pages()\n"
        "tops = {name.split('.')[0] for name in sys.modules} - set(sys.stdlib_module_names)\n"
        "print(*sorted(tops - {'docs', 'sniff', 'dissectors', 'numpy', 'fastcrc', '__main__', '_distutils_hack',"
        " 'sitecustomize'}))"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == ""
