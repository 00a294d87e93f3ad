"""The box in the plant room: what runs all buses unattended, watches them, and says how it stands."""
