"""A PROFIBUS master of somebody else (pyprofibus) with a slave of its own and with ours: every telegram is found."""

from __future__ import annotations

from functools import partial
from itertools import count
from typing import Any

import pytest

from dissectors import registry
from dissectors.frame import Chunk, Frame
from dissectors.line import LineSettings, Timing
from dissectors.profibus.simulated_slave import Slave
from dissectors.profibus.slave_state import SlaveState
from dissectors.profibus.watch import BusWatch
from dissectors.tracker import Transaction, Verdict
from sniff.engine.engine import Engine, Row

pytest.importorskip("pyprofibus", reason="pyprofibus is not installed")
pytestmark = pytest.mark.filterwarnings("ignore")
LINE = LineSettings.parse("19200,8E1")
TIMING = Timing(LINE)
ADDRESS = 8


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each look at the master's clock finds it 0.2 ms later: nothing waits for a real one."""
    from pyprofibus import dp_master, phy, util

    ticks = count(0, 0.0002)
    for module in (dp_master, phy, util):
        monkeypatch.setattr(module, "monotonic_time", partial(next, ticks))


class Wire:
    """What was sent, with times of a clock that only telegrams move."""

    def __init__(self) -> None:
        self.now = 10**18
        self.chunks: list[Chunk] = []

    def carry(self, octets: bytes) -> None:
        self.now += LINE.bits(40) + len(octets) * LINE.char
        self.chunks.append(Chunk(self.now, octets))


def run_master(rounds: int, answer: Any, wire: Wire) -> int:
    """A pyprofibus master of class 1 with one slave; `answer(octets, is_srd)` → what the slave says. Gives how many
    rounds brought inputs."""
    from pyprofibus import dp_master
    from pyprofibus.dp import DpCfgDataElement
    from pyprofibus.phy import CpPhy

    class Phy(CpPhy):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__()
            self.answers: list[bytes] = []

        def sendData(self, telegramData: bytes, srd: bool) -> None:  # noqa: N803
            octets = bytes(telegramData)
            wire.carry(octets)
            said = answer(octets, srd)
            if said:
                wire.carry(said)
                self.answers.append(said)

        def pollData(self, timeout: float = 0.0) -> bytearray | None:
            return bytearray(self.answers.pop(0)) if self.answers else None

    phy = Phy()
    phy.setConfig(baudrate=19200)
    master = dp_master.DPM1(phy=phy, masterAddr=2, debug=False)
    slave = dp_master.DpSlaveDesc(slaveConf=None)
    slave.slaveAddr, slave.identNumber, slave.inputSize, slave.outputSize = ADDRESS, 0xF510, 32, 32
    slave.setPrmTelegram.da = slave.chkCfgTelegram.da = ADDRESS
    slave.setPrmTelegram.identNumber = 0xF510
    slave.setSyncMode(False)
    slave.setFreezeMode(False)
    slave.setGroupMask(1)
    slave.setWatchdog(300)
    slave.chkCfgTelegram.addCfgDataElement(DpCfgDataElement(0x7F))
    master.addSlave(slave)
    master.initialize()
    got = 0
    for _ in range(rounds):
        slave.setMasterOutData(bytearray(range(32)))
        master.run()
        got += slave.getMasterInData() is not None
    return got


def read(wire: Wire) -> tuple[list[Row], list[Transaction], BusWatch]:
    engine, watch = Engine(registry.get("profibus"), TIMING), BusWatch(TIMING)
    outputs = [engine.feed(chunk) for chunk in wire.chunks] + [engine.close()]
    rows = [row for output in outputs for row in output.rows]
    for row in rows:
        watch.see(row.no, row.event, row.header)
    return rows, [closed for output in outputs for closed in output.transactions], watch


def all_found(wire: Wire, rows: list[Row]) -> None:
    assert [row.event.octets for row in rows] == [chunk.octets for chunk in wire.chunks]
    assert all(isinstance(row.event, Frame) and row.event.ok for row in rows)


def test_a_master_of_somebody_else_brings_our_slave_up() -> None:
    wire, slave = Wire(), Slave(ADDRESS, LINE)

    def answer(octets: bytes, is_srd: bool) -> bytes:
        sends = slave.hear(wire.now, octets, True)
        return sends[0].octets if sends else b""

    assert run_master(600, answer, wire) > 0
    rows, closed, watch = read(wire)
    all_found(wire, rows)
    assert slave.state is SlaveState.EXCHANGE
    kinds = {one.kind for one in closed if one.verdict is Verdict.ANSWERED}
    assert kinds >= {"fdl-status", "slave-diagnosis", "set-parameters", "check-configuration", "data-exchange"}
    assert not [one for one in closed if one.verdict in (Verdict.NO_RESPONSE, Verdict.UNSOLICITED) and one.id > 1]
    states = [state for _, state in watch.slaves[ADDRESS].changes]
    assert states[-3:] == [SlaveState.WAIT_CONFIGURATION, SlaveState.CONFIGURED, SlaveState.EXCHANGE]


def test_its_own_slave_is_read_as_well() -> None:
    from pyprofibus.phy_dummy import CpPhyDummySlave

    wire, other = Wire(), CpPhyDummySlave()

    def answer(octets: bytes, is_srd: bool) -> bytes:
        other.sendData(octets, is_srd)
        said = other.pollData()
        return b"" if said is None else bytes(said)

    run_master(600, answer, wire)
    rows, closed, _ = read(wire)
    all_found(wire, rows)
    assert "data-exchange" in {one.kind for one in closed if one.verdict is Verdict.ANSWERED}


def test_answers_that_the_master_does_not_get_are_asked_for_again() -> None:
    wire, slave, asked = Wire(), Slave(ADDRESS, LINE), count(1)

    def answer(octets: bytes, is_srd: bool) -> bytes:
        sends = slave.hear(wire.now, octets, True)
        is_lost = is_srd and (at := next(asked)) > 30 and at % 9 == 0
        return b"" if not sends or is_lost else sends[0].octets

    run_master(6000, answer, wire)
    rows, closed, _ = read(wire)
    all_found(wire, rows)
    lost = [one for one in closed if one.verdict is Verdict.NO_RESPONSE]
    assert len(lost) > 3
    assert {one.station for one in lost} == {ADDRESS}
    assert [one for one in closed if one.verdict is Verdict.ANSWERED and one.id > lost[-1].id - 5]
