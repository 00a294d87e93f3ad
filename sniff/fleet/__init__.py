"""A whole archive judged in one command: every bus, every day, and what changed."""
