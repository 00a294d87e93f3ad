"""The engine: items of a capture in, rows and transactions out, whatever the protocol. Pure."""
