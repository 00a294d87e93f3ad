"""Brokers for tests: a real one with TLS and a password; one that accepts and never reads; what a subscriber got."""

from __future__ import annotations

import shutil
import socket
import ssl
import subprocess
import threading
from pathlib import Path
from typing import Any

from tests.e2e.recording_bus import wait_until

PROGRAM = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
PASSWORDS = shutil.which("mosquitto_passwd") or shutil.which("mosquitto_passwd", path="/usr/sbin")
OPENSSL = shutil.which("openssl")
USER = "plant-room"


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number: int = free.getsockname()[1]
        return number


class Mosquitto:
    """Debian's broker on a port of its own, with TLS and a password; it keeps nothing over its end."""

    def __init__(self, folder: Path, password: str) -> None:
        self.folder, self.port, self._password = folder, free_port(), password
        self.ca = folder / "ca.pem"
        self._make_certificates()
        self._run(PASSWORDS, "-b", "-c", "passwords", USER, password)
        (folder / "broker.conf").write_text(
            f"listener {self.port} 127.0.0.1\nallow_anonymous false\npassword_file {folder}/passwords\nuser root\n"
            f"cafile {self.ca}\ncertfile {folder}/server.pem\nkeyfile {folder}/server.key\npersistence false\n"
        )
        self._process: subprocess.Popen[bytes] | None = None

    def _run(self, *words: object) -> None:
        subprocess.run([str(word) for word in words], cwd=self.folder, check=True, capture_output=True)

    def _make_certificates(self) -> None:
        (self.folder / "names").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1")
        key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout")
        self._run(OPENSSL, "req", "-x509", *key, "ca.key", "-out", "ca.pem", "-days", 2, "-subj", "/CN=a ca")
        self._run(OPENSSL, "req", *key, "server.key", "-out", "server.csr", "-subj", "/CN=localhost")
        self._run(
            OPENSSL, "x509", "-req", "-in", "server.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial",
            "-days", 2, "-out", "server.pem", "-extfile", "names",
        )  # fmt: skip

    def start(self) -> None:
        assert PROGRAM is not None
        self._process = subprocess.Popen(
            [PROGRAM, "-c", self.folder / "broker.conf"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

        def listens() -> bool:
            assert self._process is not None
            assert self._process.poll() is None, "the broker ended"
            with socket.socket() as trial:
                return trial.connect_ex(("127.0.0.1", self.port)) == 0

        wait_until(listens, "the broker does not listen")

    def stop(self) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.wait()
            self._process = None

    def subscribe(self) -> Subscriber:
        return Subscriber(self.port, self._password, self.ca)


class Subscriber:
    """`got`: the newest of each topic. Gets everything that a broker has."""

    def __init__(self, port: int, password: str, ca: Path) -> None:
        import paho.mqtt.client as mqtt

        self.got: dict[str, bytes] = {}
        self._client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2)
        self._client.username_pw_set(USER, password)
        self._client.tls_set_context(ssl.create_default_context(cafile=ca))
        self._client.on_message = self._take
        self._client.on_connect = lambda client, *_: client.subscribe("#", 1)
        self._client.connect("localhost", port)
        self._client.loop_start()

    def _take(self, client: Any, data: Any, message: Any) -> None:
        self.got[message.topic] = message.payload

    def keep(self, topic: str, payload: bytes) -> None:
        """Have the broker keep something."""
        self._client.publish(topic, payload, 1, True).wait_for_publish(60)

    def until(self, topic: str, payload: bytes | None = None) -> bytes:
        """What came of a topic, or until this did."""
        wait_until(
            lambda: self.got.get(topic) == payload if payload is not None else topic in self.got,
            f"{topic} never came: {sorted(self.got)}",
        )
        return self.got[topic]

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()


class StuckBroker:
    """Accepts, says that the connection is fine, and never reads again."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.port: int = self._server.getsockname()[1]
        self._taken: list[socket.socket] = []
        self.accepted = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        while True:
            try:
                taken, _ = self._server.accept()
            except OSError:
                return
            self._taken.append(taken)
            taken.recv(4096)
            taken.sendall(b"\x20\x02\x00\x00")  # CONNACK, accepted
            self.accepted.set()

    def close(self) -> None:
        self._server.close()
        for taken in self._taken:
            taken.close()
