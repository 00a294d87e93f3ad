"""Octets → frames → headers → transactions → packets.

Pure: no I/O, no clock, no threads. Time comes in with the data, as integer nanoseconds.
Start at `frame.py` (the values), then `framer.py` and `tracker.py` (the contracts), then a protocol's folder.

    from dissectors import registry
    from dissectors.frame import Chunk, Frame
    from dissectors.line import LineSettings, Timing

    rtu = registry.get("modbus-rtu")
    framer = rtu.framer(Timing(LineSettings.parse("19200,8E1")))
    events = framer.feed(Chunk(10**9, bytes.fromhex("010300000002C40B"))) + framer.close()
    for event in events:
        if isinstance(event, Frame):
            print(rtu.peek(event).kind)  # read-holding-registers
"""
