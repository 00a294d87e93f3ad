"""A Modbus serial server made by others, as a program: pymodbus_server.py PORT rtu|ascii BAUD

Says "ready" when it listens; ends when its standard input ends. Unit 1 has 64 registers and coils from address 0;
for every other unit it answers with an exception. A pseudo-terminal knows neither parity nor 7 data bits, so the
port is opened with neither, whatever the line.
"""

from __future__ import annotations

import asyncio
import sys
import threading

from pymodbus import FramerType, ModbusDeviceIdentification, pymodbus_apply_logging_config
from pymodbus.server import ModbusSerialServer
from pymodbus.simulator import DataType, SimData, SimDevice


def device() -> SimDevice:
    registers = [SimData(0, values=list(range(0x100, 0x140)), datatype=DataType.REGISTERS)]
    bits = [SimData(0, values=[place % 3 == 0 for place in range(64)], datatype=DataType.BITS)]
    return SimDevice(1, simdata=(list(bits), list(bits), list(registers), list(registers)))


async def serve(port: str, framing: str, baud: int) -> None:
    server = ModbusSerialServer(
        device(),
        framer=FramerType(framing),
        identity=ModbusDeviceIdentification(info_name={"VendorName": "a vendor", "ProductCode": "a product"}),
        port=port,
        baudrate=baud,
        broadcast_enable=True,
    )
    await server.serve_forever(background=True)
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()

    def wait_for_the_end() -> None:
        sys.stdin.read()
        loop.call_soon_threadsafe(ended.set)

    threading.Thread(target=wait_for_the_end, daemon=True).start()
    print("ready", flush=True)
    await ended.wait()
    await server.shutdown()


if __name__ == "__main__":
    pymodbus_apply_logging_config("CRITICAL")
    asyncio.run(serve(sys.argv[1], sys.argv[2], int(sys.argv[3])))
