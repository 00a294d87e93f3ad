"""A recording of `demo` has the values of its drives on channels that the stock MCAP reader decodes by their schema."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals")


def flat_schema() -> Any:
    spec = importlib.util.spec_from_file_location(
        "flat_schema", Path(__file__).parents[1] / "sniff" / "bus" / "flat_schema.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("demo")
    path = folder / "demo.mcap"
    command = [
        sys.executable,
        "-m",
        "sniff",
        "demo",
        "--clean",
        "-w",
        str(path),
        "--duration",
        "4",
        "-d",
        "*=teco-e510",
    ]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=folder, env=environment, check=False)
    assert ran.returncode == 0, ran.stderr
    assert "read status, fault" in ran.stdout
    return path


def test_every_value_channel_is_flat_and_decodes(recording: Path) -> None:
    from mcap.reader import make_reader

    flat = flat_schema()
    seen: dict[str, list[float]] = {}
    with recording.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages():
            if not channel.topic.startswith("/values/"):
                continue
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            layout = json.loads(schema.data)
            assert flat.faults(layout) == []
            value = json.loads(message.data)
            assert flat.misfits(layout, value) == []
            assert "unit" in channel.metadata
            seen.setdefault(channel.topic, []).append(value["value"])
    for station in (1, 2, 3):
        assert f"/values/demo/{station}/status" in seen
        assert f"/values/demo/{station}/output-frequency" in seen
        assert f"/values/demo/{station}/status.running" in seen


def test_the_channels_hold_what_points_computes(recording: Path) -> None:
    """Best effort on the way into the file, but what is there is right."""
    from mcap.reader import make_reader

    command = [sys.executable, "-m", "sniff", "points", str(recording), "--json"]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True, cwd=Path(__file__).parents[2])
    computed = {}
    for line in ran.stdout.splitlines():
        sample = json.loads(line)
        computed[sample["device"], sample["point"], sample["frame"]] = sample["value"], sample["raw"]
    found = 0
    with recording.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            if channel.topic.startswith("/values/demo/"):
                station, _, point = channel.topic.removeprefix("/values/demo/").partition("/")
                value = json.loads(message.data)
                assert computed[station, point, value["frame"]] == (value["value"], value["raw"])
                found += 1
    assert found > 20
