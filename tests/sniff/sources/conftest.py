from __future__ import annotations

import os
import select
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

pytest.importorskip("termios")


@dataclass
class Pty:
    """The other side of a port: what it writes arrives, what it can read has been sent."""

    master: int
    path: str

    def feed(self, octets: bytes) -> None:
        os.write(self.master, octets)

    def heard(self) -> bytes:
        """Everything that the port's side ever sent."""
        heard = b""
        while select.select([self.master], [], [], 0.02)[0]:
            try:
                heard += os.read(self.master, 4096)
            except OSError:  # nobody has the port open any more
                break
        return heard

    def unplug(self) -> None:
        if self.master >= 0:
            os.close(self.master)
            self.master = -1


@pytest.fixture
def pty() -> Iterator[Pty]:
    import tty

    master, slave = os.openpty()
    tty.setraw(slave)
    pair = Pty(master, os.ttyname(slave))
    os.close(slave)
    yield pair
    pair.unplug()
