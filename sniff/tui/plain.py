"""Text from the wire, made harmless: see `sniff.analysis.plain`."""

from sniff.analysis.plain import ascii_of, plain

__all__ = ["ascii_of", "plain"]
