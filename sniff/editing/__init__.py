"""Captures made of captures: merged, cut, compared, with other settings, without names."""
