"""A simulated DP slave: a pure station of a virtual bus (dissectors/simulated.py)."""

from __future__ import annotations

from collections.abc import Callable

from dissectors.line import MS, LineSettings
from dissectors.profibus import diagnosis as bits
from dissectors.profibus.configuration import parse_configuration
from dissectors.profibus.control import Control, Status
from dissectors.profibus.diagnosis import NO_MASTER
from dissectors.profibus.parameters import parse_global_control, parse_parameters
from dissectors.profibus.services import Service, service_of
from dissectors.profibus.simulated_wire import telegrams_of
from dissectors.profibus.slave_state import SlaveState
from dissectors.profibus.telegram import BROADCAST, SC, Telegram, telegram
from dissectors.simulated import Send

Process = Callable[[bytes, int], bytes]
"""(outputs, ns) → inputs."""


def echoing(outputs: bytes, now: int) -> bytes:
    """A process that gives back what it is told."""
    return outputs


class Slave:
    """A slave of DP-V0.

    `address` 0 … 125. `configuration`: its identifiers. `tsdr`: bit times until it answers. `process`: what becomes of
    outputs. `trouble(now)`: blocks of extended diagnosis, empty while all is well; `pending` is told when they change.
    """

    def __init__(
        self,
        address: int,
        line: LineSettings,
        *,
        ident: int = 0xF510,
        configuration: bytes = b"\x7f",
        tsdr: int = 30,
        process: Process = echoing,
        trouble: Callable[[int], bytes] = lambda now: b"",
    ) -> None:
        self.address = address
        self.ident = ident
        self.configuration = configuration
        self.state = SlaveState.WAIT_PARAMETERS
        self.silent = False
        self._delay = line.bits(tsdr)
        self._process = process
        self._trouble = trouble
        self._told_trouble = b""
        modules = parse_configuration(configuration)
        self._outputs = bytes(sum(module.outputs for module in modules))
        self._inputs = sum(module.inputs for module in modules)
        self._master = NO_MASTER
        self._fault = 0
        self._watchdog: int | None = None
        self._heard = 0
        self._last: tuple[bytes, bool, bytes] | None = None  # request, its frame count bit, the answer to it

    def hear(self, now: int, octets: bytes, quiet: bool) -> tuple[Send, ...]:
        """Answer a request for this address; obey what is for all."""
        self._expire(now)
        sends: tuple[Send, ...] = ()
        for raw, heard in telegrams_of(octets):
            if heard.control is None or not heard.is_request:
                continue
            if heard.destination == BROADCAST:
                self._obey(heard)
            elif heard.destination == self.address and not self.silent:
                answer = self._answer(raw, heard, heard.control, now)
                sends = (Send(now + self._delay, answer),) if answer else ()
        return sends

    def wake(self, now: int) -> tuple[Send, ...]:
        """Never speaks unasked."""
        return ()

    def next_wake(self) -> int | None:
        """Waits for traffic only."""
        return None

    def reset(self) -> None:
        """Lose everything that power-up loses."""
        self.state, self._master, self._fault, self._watchdog = SlaveState.WAIT_PARAMETERS, NO_MASTER, 0, None

    def _expire(self, now: int) -> None:
        if self._watchdog is not None and self.state is SlaveState.EXCHANGE and now - self._heard > self._watchdog:
            self.reset()

    def _obey(self, heard: Telegram) -> None:
        control = parse_global_control(heard.data)
        if service_of(heard) is Service.GLOBAL_CONTROL and control is not None and control.is_clear:
            self._outputs = bytes(len(self._outputs))

    def _answer(self, raw: bytes, heard: Telegram, control: Control, now: int) -> bytes:
        if heard.source == self._master:
            self._heard = now
        if self._last is not None and control.fcv and self._last[0] == raw and self._last[1] == control.fcb:
            return self._last[2]  # the master has not understood the answer
        answer = self._first_answer(heard, now)
        self._last = (raw, control.fcb, answer)
        return answer

    def _first_answer(self, heard: Telegram, now: int) -> bytes:
        service = service_of(heard)
        if service is Service.FDL_STATUS:
            return telegram(heard.source or 0, self.address, 0x00)
        if service is Service.DIAGNOSIS:
            return self._reply(heard, Status.DATA_LOW, self._diagnosis(heard.source, now))
        if service is Service.SET_PARAMETERS:
            return self._parameterised(heard, now)
        if service is Service.CHECK_CONFIGURATION:
            return self._configured(heard)
        if service is Service.GET_CONFIGURATION:
            return self._reply(heard, Status.DATA_LOW, self.configuration)
        if service is Service.READ_INPUTS:
            return self._reply(heard, Status.DATA_LOW, self._read(now))
        if service is Service.READ_OUTPUTS:
            return self._reply(heard, Status.DATA_LOW, self._outputs)
        if service is Service.DATA_EXCHANGE:
            return self._exchange(heard, now)
        return self._reply(heard, Status.NOT_ACTIVATED)

    def _exchange(self, heard: Telegram, now: int) -> bytes:
        if self.state is not SlaveState.EXCHANGE or heard.source != self._master:
            return self._reply(heard, Status.NOT_ACTIVATED)
        if len(heard.data) == len(self._outputs):
            self._outputs = heard.data
        is_new = self._trouble(now) != self._told_trouble
        inputs = self._read(now)
        if not inputs and not is_new:
            return bytes((SC,))
        return self._reply(heard, Status.DATA_HIGH if is_new else Status.DATA_LOW, inputs)

    def _read(self, now: int) -> bytes:
        return self._process(self._outputs, now)[: self._inputs].ljust(self._inputs, b"\0")

    def _parameterised(self, heard: Telegram, now: int) -> bytes:
        given = parse_parameters(heard.data)
        if given is None or given.ident != self.ident:
            self.reset()
            self._fault = bits.PARAMETER_FAULT
        elif self._master in (NO_MASTER, heard.source):
            self.state, self._fault, self._master = SlaveState.WAIT_CONFIGURATION, 0, heard.source or 0
            watchdogs = given.watchdogs_ms
            self._watchdog, self._heard = None if watchdogs is None else watchdogs[1] * MS, now
        return bytes((SC,))

    def _configured(self, heard: Telegram) -> bytes:
        if self.state is SlaveState.WAIT_CONFIGURATION:
            if heard.data == self.configuration:
                self.state = SlaveState.EXCHANGE
            else:
                self.reset()
                self._fault = bits.CONFIGURATION_FAULT
        return bytes((SC,))

    def _diagnosis(self, asker: int | None, now: int) -> bytes:
        trouble = self._told_trouble = self._trouble(now)
        ready = self.state is SlaveState.EXCHANGE
        first = self._fault | (0 if ready else bits.NOT_READY) | (bits.EXTENDED if trouble else 0)
        if self._master not in (NO_MASTER, asker):
            first |= bits.LOCKED
        wants = bits.PARAMETERS_WANTED if self.state is SlaveState.WAIT_PARAMETERS else 0
        second = 0x04 | wants | (bits.WATCHDOG if self._watchdog is not None else 0)
        return bytes((first, second, 0, self._master, self.ident >> 8, self.ident & 0xFF)) + trouble

    def _reply(self, heard: Telegram, status: Status, data: bytes = b"") -> bytes:
        return telegram(heard.source or 0, self.address, status.value, data, heard.ssap, heard.dsap)
