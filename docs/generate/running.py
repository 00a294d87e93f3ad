"""The program run inside this process: what it printed, and its exit code."""

from __future__ import annotations

import contextlib
import io
import json
import os
from typing import Any, NamedTuple


class Run(NamedTuple):
    """What a command gave."""

    code: int
    out: str
    err: str


def run(arguments: list[str]) -> Run:
    """Run one command; terminals are 100 columns wide to it."""
    from sniff.cli import main

    streams = [io.TextIOWrapper(io.BytesIO(), encoding="utf-8", newline="\n") for _ in range(2)]
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = "100"
    try:
        with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
            try:
                code = main(arguments)
            except SystemExit as end:  # --help, --version, and what argparse refuses
                code = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
    return Run(code, *(_text(stream) for stream in streams))


def json_lines(arguments: list[str]) -> list[dict[str, Any]]:
    """What a command prints with --json; RuntimeError where it fails."""
    said = run(arguments)
    if said.code not in (0, 1):
        raise RuntimeError(f"sniff485 {' '.join(arguments)}: {said.err}")
    return [json.loads(line) for line in said.out.splitlines()]


def _text(stream: io.TextIOWrapper) -> str:
    stream.flush()
    stream.seek(0)
    return stream.read()
