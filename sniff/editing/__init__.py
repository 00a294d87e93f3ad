"""Captures made of captures: merged, cut, compared, without names."""
