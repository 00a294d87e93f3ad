"""MQTT against a real broker with TLS and a password, and against one that never reads."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("termios")
pytest.importorskip("aiomqtt")

from dissectors.modbus.envelope import seal_rtu
from tests.e2e.broker import OPENSSL, PASSWORDS, PROGRAM, USER, Mosquitto, StuckBroker
from tests.e2e.recording_bus import Feeder, octets_of, recordings, wait_until

PASSWORD = "k33p-me-o%t of everything"
POLL, ANSWER = seal_rtu(b"\1\3\0\0\0\2"), seal_rtu(b"\1\3\4\0\1\0\2")
UNANSWERED = seal_rtu(b"\7\3\0\0\0\2")
VALUE = "sniff485/x/values/1/holding/40001"

real_broker = pytest.mark.skipif(
    not (PROGRAM and PASSWORDS and OPENSSL), reason="needs mosquitto, mosquitto_passwd and openssl"
)


@pytest.fixture
def bus() -> Iterator[Feeder]:
    made = Feeder()
    yield made
    made.close()


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Mosquitto]:
    folder = tmp_path / "broker"
    folder.mkdir()
    made = Mosquitto(folder, PASSWORD)
    made.start()
    yield made
    made.stop()


def configure(folder: Path, bus: Feeder, text: str) -> None:
    (folder / "sniff485.toml").write_text(f'[bus.x]\nport = "{bus.path}"\n{text}')


@real_broker
def test_values_discovery_and_findings_arrive_also_after_the_broker_was_gone(
    bus: Feeder, broker: Mosquitto, tmp_path: Path
) -> None:
    (tmp_path / "password").write_text(PASSWORD + "\n")
    (tmp_path / "password").chmod(0o600)
    configure(
        tmp_path, bus,
        f'[mqtt]\nbroker = "mqtts://localhost:{broker.port}"\nuser = "{USER}"\npassword_file = "password"\n'
        f'ca = "{broker.ca}"\nevery = 0.2\n',
    )  # fmt: skip
    subscriber = broker.subscribe()
    with recordings(tmp_path, "x") as begin:
        command = begin()
        bus.poll(POLL + ANSWER + UNANSWERED, 0.05)
        value = json.loads(subscriber.until(VALUE))
        assert (value["value"], value["quality"]) == (1, 0)
        assert subscriber.until("sniff485/status") == b"online"
        assert subscriber.until("sniff485/x/status") == b"online"
        found = json.loads(subscriber.until("sniff485/x/findings/MB001/station-7"))
        assert found["what"] == "new"
        assert "health" in json.loads(subscriber.until("sniff485/x/health"))
        subscriber.until("sniff485/x/problem", b"ON")
        (config,) = (
            json.loads(text) for topic, text in subscriber.got.items()
            if topic.startswith("homeassistant/sensor/") and VALUE in text.decode()
        )  # fmt: skip
        assert config["state_topic"] == VALUE
        assert {one["topic"] for one in config["availability"]} == {"sniff485/status", "sniff485/x/status"}
        subscriber.close()

        broker.stop()
        command.until_it_says("mqtt: localhost")
        broker.start()
        command.until_it_says("mqtt: goes on")
        subscriber = broker.subscribe()  # the broker has forgotten everything: all of it is told anew
        assert json.loads(subscriber.until("sniff485/x/findings/MB001/station-7"))["what"] == "new"
        first = json.loads(subscriber.until(VALUE))["t"]
        wait_until(lambda: json.loads(subscriber.got[VALUE])["t"] > first, "no new value after that")

        bus.quiet()
        bus.until_read()
        command.send(15)
        assert command.end() == 0
        subscriber.until("sniff485/status", b"offline")
        subscriber.until("sniff485/x/status", b"offline")
        subscriber.until("sniff485/x/findings/MB001/station-7", b"")  # nobody will say when it is over
        subscriber.until("sniff485/x/problem", b"OFF")
        subscriber.close()
        assert octets_of(tmp_path / "x.mcap") == bytes(bus.fed), "the capture is whole all the same"
    said = "\n".join(command.said)
    assert PASSWORD not in said
    assert PASSWORD.encode() not in (tmp_path / "x.mcap").read_bytes()


@real_broker
def test_findings_that_a_killed_run_left_are_taken_away(bus: Feeder, broker: Mosquitto, tmp_path: Path) -> None:
    configure(tmp_path, bus, f'[mqtt]\nbroker = "mqtts://{USER}@localhost:{broker.port}"\nca = "{broker.ca}"\n')
    stale, others = "sniff485/x/findings/MB001/station-9", "sniff485/y/findings/MB001/station-9"
    subscriber = broker.subscribe()
    for topic in (stale, others):
        subscriber.keep(topic, b"{}")
        subscriber.until(topic, b"{}")
    with recordings(tmp_path, "x") as begin:
        command = begin(environment={"SNIFF485_MQTT_PASSWORD": PASSWORD})
        bus.poll(POLL + ANSWER + UNANSWERED, 0.05)
        subscriber.until(stale, b"")
        assert json.loads(subscriber.until("sniff485/x/findings/MB001/station-7"))["what"] == "new"
        bus.quiet()
        bus.until_read()
        command.send(15)
        assert command.end() == 0
    assert subscriber.got[others] == b"{}"
    subscriber.close()


@real_broker
def test_a_wrong_password_is_said_and_not_shown(bus: Feeder, broker: Mosquitto, tmp_path: Path) -> None:
    wrong = "another one than that"
    configure(tmp_path, bus, f'[mqtt]\nbroker = "mqtts://{USER}@localhost:{broker.port}"\nca = "{broker.ca}"\n')
    with recordings(tmp_path, "x") as begin:
        command = begin(environment={"SNIFF485_MQTT_PASSWORD": wrong})
        said = command.until_it_says("mqtt: localhost")
        assert "uthori" in said
        command.send(15)
        assert command.end() == 0
    assert wrong not in "\n".join(command.said)


def test_a_broker_that_never_reads_costs_values_and_no_octet(bus: Feeder, tmp_path: Path) -> None:
    stuck = StuckBroker()
    configure(tmp_path, bus, f'[mqtt]\nbroker = "mqtt://127.0.0.1:{stuck.port}"\nevery = 0\n')
    try:
        with recordings(tmp_path, "x") as begin:
            command = begin()
            assert stuck.accepted.wait(60)
            bus.poll(POLL + ANSWER, 0.005)
            wait_until(lambda: len(octets_of(tmp_path / "x.mcap")) > 4000, "nothing is recorded")
            bus.quiet()
            bus.until_read()
            command.send(15)
            assert command.end() == 0
            assert octets_of(tmp_path / "x.mcap") == bytes(bus.fed)
    finally:
        stuck.close()
    assert "DROPPED" in next(line for line in command.said if line.startswith("sniff485: mqtt:"))
