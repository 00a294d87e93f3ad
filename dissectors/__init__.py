"""Octets → frames → headers → transactions → packets.

Pure: no I/O, no clock, no threads. Time comes in with the data, as integer nanoseconds.
Start at `frame.py` (the values), then `framer.py` and `tracker.py` (the contracts), then a protocol's folder.
"""
