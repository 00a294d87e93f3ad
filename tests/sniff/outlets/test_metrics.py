"""OpenMetrics: what a parser of somebody else's reads, over real HTTP; nothing hostile gets through."""

from __future__ import annotations

import http.client
import re
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from sniff.bus.model import BusModel
from sniff.bus.offline import survey
from sniff.engine.follow_settings import dissector_for
from sniff.formats import read
from sniff.outlets.metrics import BusNow, exposition
from sniff.outlets.metrics_server import READERS, MetricsServer

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


def test_a_parser_of_somebody_else_reads_it(tmp_path: Path) -> None:
    """In a process of its own: its licence does not go beside scapy."""
    page = tmp_path / "metrics"
    page.write_text(exposition([told("rtu-usual-faults")]))
    program = (
        "from prometheus_client.openmetrics.parser import text_string_to_metric_families as parse\n"
        f"found = {{one.name: one for one in parse(open({str(page)!r}).read())}}\n"
        "print(found['sniff485_frames'].samples[0].value, found['sniff485_response_seconds'].type)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    if "ModuleNotFoundError" in done.stderr:
        pytest.skip("prometheus_client is not installed")
    assert done.returncode == 0, done.stderr
    frames, kind = done.stdout.split()
    assert float(frames) == told("rtu-usual-faults").model.summary.frames
    assert kind == "summary"


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
