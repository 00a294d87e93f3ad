"""The terminal UI in a browser: a server of its own that starts one terminal UI a viewer (textual-serve)."""
