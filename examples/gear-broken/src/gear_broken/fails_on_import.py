"""Fails on import."""

raise RuntimeError("this package was made for another machine")
