"""Who may look at a served capture."""

from __future__ import annotations

import pytest

from sniff.browser.access import Access, is_loopback
from sniff.cli import main
from sniff.outlet_settings import TOKEN_ENV

TOKEN = "0123456789abcdef0123"
HERE = {"Host": "127.0.0.1:8485", "Origin": "http://127.0.0.1:8485"}
THERE = {"Host": "pi.example:8485", "Origin": "http://pi.example:8485"}


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "::1", "localhost"])
def test_what_is_of_this_machine(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.2", "pi.example", "localhost.example", ""])
def test_what_is_not(host: str) -> None:
    assert not is_loopback(host)


def test_this_machine_may_look_without_a_token() -> None:
    assert not Access().refusal(HERE, "", for_screen=True)
    assert not Access().refusal({"Host": "[::1]:8485", "Origin": "http://[::1]:8485"}, "", for_screen=True)


def test_a_name_that_was_made_to_point_here_is_refused() -> None:
    assert "this machine alone" in Access().refusal(THERE, "", for_screen=False)
    assert "this machine alone" in Access().refusal({}, "", for_screen=False)


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null", "http://127.0.0.1:9999"])
def test_a_page_of_somebody_else_gets_no_screen(origin: str | None) -> None:
    headers = {"Host": HERE["Host"], **({"Origin": origin} if origin else {})}
    assert "own page" in Access().refusal(headers, "", for_screen=True)
    assert "own page" in Access(TOKEN, remote=True).refusal(headers, TOKEN, for_screen=True)


@pytest.mark.parametrize("said", ["", TOKEN[:-1], TOKEN + "0", TOKEN.upper(), "ä" * 20, "\udc80"])
def test_a_wrong_token_opens_nothing(said: str) -> None:
    assert "token" in Access(TOKEN, remote=True).refusal(THERE, said, for_screen=False)


def test_the_right_one_does() -> None:
    assert not Access(TOKEN, remote=True).refusal(THERE, TOKEN, for_screen=True)


@pytest.mark.parametrize(
    ("options", "token", "said"),
    [
        (["--host", "0.0.0.0"], "", "--allow-remote"),
        (["--host", "0.0.0.0"], TOKEN, "--allow-remote"),
        (["--allow-remote"], "", "needs a token"),
        (["--allow-remote"], "short", "at least 16"),
        (["--allow-remote"], "with spaces and more of them", "at least 16"),
        (["--allow-remote", "--token-file", "/no/token"], TOKEN, "/no/token: No such file"),
    ],
)
def test_other_addresses_need_both(
    options: list[str], token: str, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("textual_serve")
    monkeypatch.setenv(TOKEN_ENV, token)
    assert main(["serve", "captures/rtu-clean.cap.txt", *options]) == 2
    assert said in capsys.readouterr().err


def test_who_looks_from_elsewhere_saves_nothing_here(monkeypatch: pytest.MonkeyPatch) -> None:
    from sniff.tui.guest import GUEST
    from sniff.tui.saving import why_not

    assert why_not("/nowhere/x.mcap") == ""
    monkeypatch.setenv(GUEST, "1")
    assert "saves nothing here" in why_not("/nowhere/x.mcap")
