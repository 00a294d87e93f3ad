"""A bus as the faces see it: live or from a file, its rows, its derived topics."""
