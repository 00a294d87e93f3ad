"""sniff485, the application: sources, recording, formats, the engine, and its two faces (command line and terminal)."""

__version__ = "0.1.0"
