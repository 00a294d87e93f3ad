"""Outlets, which tell others while a bus is listened to: listeners that may fall behind, and that nothing waits for."""
