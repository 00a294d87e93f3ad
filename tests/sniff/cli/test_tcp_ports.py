"""A port that no machine has is said while the command is read."""

from __future__ import annotations

import pytest

from sniff.cli import main


@pytest.mark.parametrize("command", [["serve", "x.mcap", "--port"], ["box", "status", "--status-port"]])
@pytest.mark.parametrize("port", ["65536", "99999", "1e3", "x"])
def test_a_port_that_cannot_be_is_said(command: list[str], port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*command, port])
    assert ended.value.code == 2
    assert "expected a port, 0 to 65535" in capsys.readouterr().err


@pytest.mark.parametrize("port", ["65536", "²", "1" * 5000])
def test_one_that_a_replay_cannot_listen_at_is_said(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "x.mcap", "--to", f"tcp:{port}"]) == 2
    assert "refused" in capsys.readouterr().err
