"""Capture as a process of its own: it reads, stamps and records; nothing in the main process can delay it."""
