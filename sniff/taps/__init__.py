"""Two taps on one line: which frame was heard at both, what happened to the others, and on which side the fault is."""
