"""OpenMetrics: what a parser of somebody else's reads, over real HTTP; nothing hostile gets through."""

from __future__ import annotations

import http.client
import json
import re
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.engine.follow_settings import dissector_for
from sniff.formats import read
from sniff.outlets import metrics_server
from sniff.outlets.metrics import _FAMILIES, BusNow, exposition
from sniff.outlets.metrics_server import READERS, MetricsServer
from tests.sniff.outlets.given import KeptOutlet

CAPTURES = Path(__file__).parents[3] / "captures"


def told(name: str, bus: str = "boiler") -> BusNow:
    capture = read(CAPTURES / f"{name}.cap.txt")
    session = replace(capture.session, bus=bus)
    model = BusModel(session, dissector_for(session))
    survey(capture, session, model)
    return BusNow(model, 7)


@pytest.fixture
def server() -> Iterator[MetricsServer]:
    made = MetricsServer(0)
    yield made
    made.close()


def test_every_line_is_as_the_specification_has_it() -> None:
    page = exposition([told("rtu-usual-faults"), told("mstp-usual-faults", "roof")])
    assert page.endswith("# EOF\n")
    sample = re.compile(r'[a-z0-9_]+\{([a-z]+="(\\.|[^"\\])*",?)+\} -?[0-9.e+-]+')
    families: list[str] = []
    for line in page.splitlines()[:-1]:
        if line.startswith("# TYPE "):
            families.append(line.split()[2])
        elif not line.startswith("#"):
            assert sample.fullmatch(line), line
            assert line.startswith(families[-1])
    assert len(set(families)) == len(families)
    assert 'sniff485_unrecorded_octets_total{bus="boiler",protocol="modbus-rtu"} 7' in page
    assert 'sniff485_finding{bus="boiler",protocol="modbus-rtu",code="MB001"' in page
    assert 'quantile="0.95"' in page


def test_a_sum_of_days_still_grows_by_milliseconds() -> None:
    one = told("rtu-usual-faults")
    node = next(node for node in one.model.summary.nodes.present() if node.latency.count)
    node.latency.total = 123_456_789_012_345
    assert f'station="{node.address}"}} 123456.789012345\n' in exposition([one])


def test_the_load_of_a_silent_bus_is_none() -> None:
    one = told("rtu-usual-faults")
    assert one.model.summary.load.last is not None
    silent = replace(one, now=one.model.summary.load.last + 60 * 10**9)
    assert 'sniff485_load_ratio{bus="boiler",protocol="modbus-rtu"} 0.0\n' in exposition([silent])
    assert "sniff485_load_ratio" in exposition([one])
    assert exposition([one]) != exposition([silent])


PARSE = """
import json, sys
from prometheus_client.openmetrics.parser import text_string_to_metric_families as parse
families = parse(sys.stdin.read())
print(json.dumps({one.name: [one.type, [[s.name, s.labels, s.value] for s in one.samples]] for one in families}))
"""


def parsed(page: str) -> dict[str, Any]:
    """Families as a parser of somebody else reads them. In a process of its own: not beside scapy, by its licence."""
    done = subprocess.run([sys.executable, "-c", PARSE], input=page, capture_output=True, text=True, check=False)
    if "ModuleNotFoundError" in done.stderr:
        pytest.skip("prometheus_client is not installed")
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_a_parser_of_somebody_else_reads_every_family() -> None:
    one, outlet = told("rtu-usual-faults"), KeptOutlet()
    outlet.dropped = 3
    found = parsed(exposition([one, told("mstp-usual-faults", "roof")], [outlet]))
    assert set(found) == {name for name, *_ in _FAMILIES}
    assert all(samples for _, samples in found.values()), [name for name, (_, samples) in found.items() if not samples]
    (frames,) = (value for _, labels, value in found["sniff485_frames"][1] if labels["bus"] == "boiler")
    assert frames == one.model.summary.frames
    assert found["sniff485_response_seconds"][0] == "summary"
    assert found["sniff485_outlet_dropped"][1] == [["sniff485_outlet_dropped_total", {"outlet": "kept"}, 3]]


def test_last_values_stand_by_name() -> None:
    one = told("rtu-usual-faults")
    found = parsed(exposition([one]))
    values = {
        (labels["device"], labels["point"]): value
        for _, labels, value in found["sniff485_value"][1]
        if labels["bus"] == "boiler"
    }
    numbers = [point.sample for point in one.model.points if point.sample.finite and not point.sample.value.bit]
    assert values == {(sample.station, sample.name): sample.value.value for sample in numbers}
    assert values
    times = found["sniff485_value_timestamp_seconds"][1]
    assert [value for *_, value in times] == pytest.approx([sample.time / 1e9 for sample in numbers], abs=1e-3, rel=0)


def test_hostile_names_are_inert() -> None:
    page = exposition([told("rtu-usual-faults", 'x"} 1\nevil 2\x1b[31m\\')])
    assert "\x1b" not in page
    assert not any(line.startswith("evil") for line in page.splitlines())


def test_the_newest_page_is_served_and_nothing_else(server: MetricsServer) -> None:
    server.page = exposition([told("rtu-usual-faults")])
    with urllib.request.urlopen(f"http://127.0.0.1:{server.port}/metrics", timeout=60) as answer:
        assert answer.headers["Content-Type"].startswith("application/openmetrics-text")
        assert "Python" not in str(answer.headers["Server"])
        assert answer.read().decode() == server.page
    with pytest.raises(urllib.error.HTTPError, match="404"):
        urllib.request.urlopen(f"http://127.0.0.1:{server.port}/etc/passwd", timeout=60)


def test_readers_that_never_read_do_not_shut_out_the_others_for_long(server: MetricsServer) -> None:
    idle = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(READERS + 3)]
    try:
        for one in idle[READERS:]:
            one.settimeout(60)
            assert one.recv(1) == b""  # too many: closed at once
    finally:
        for one in idle:
            one.close()
    until = 200
    while True:
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
        try:
            connection.request("GET", "/metrics")
            assert connection.getresponse().status == 200
            break
        except (OSError, http.client.HTTPException):
            until -= 1
            assert until
        finally:
            connection.close()


def status(port: int, path: str = "/metrics", method: str = "GET", **headers: str) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request(method, path, headers=headers)
        return connection.getresponse().status
    finally:
        connection.close()


def test_a_token_is_asked_for_where_there_is_one() -> None:
    token = "a token that is long enough"
    server = MetricsServer(0, token=token)
    try:
        assert status(server.port) == 401
        assert status(server.port, Authorization="Bearer another") == 401
        assert status(server.port, "/metrics?token=another") == 401
        assert status(server.port, "/metrics?token=" + "x" * 5000) == 401
        assert status(server.port, Authorization=f"Bearer {token}") == 200
        assert status(server.port, "/metrics?token=a+token+that+is+long+enough") == 200
    finally:
        server.close()


def test_it_can_only_be_read(server: MetricsServer) -> None:
    assert [status(server.port, method=method) for method in ("POST", "PUT", "DELETE")] == [501] * 3
    assert status(server.port, "/") == 404


def test_who_asks_too_slowly_is_hung_up_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(metrics_server, "ALL_PATIENCE", 0.05)
    server = MetricsServer(0)
    try:
        with socket.create_connection(("127.0.0.1", server.port), timeout=60) as slow:
            slow.sendall(b"GET /metrics HTTP/1.1\r\n")
            assert slow.recv(1) == b""
    finally:
        server.close()
