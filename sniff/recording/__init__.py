"""Recordings: MCAP files that survive whatever befalls the machine, read whole, cut or damaged."""
