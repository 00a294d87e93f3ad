"""A virtual RS-485 bus: simulated stations and faults, in real time on pseudo-terminals or as fast as it goes."""
