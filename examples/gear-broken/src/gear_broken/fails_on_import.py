"""Raises an exception while it is imported."""

raise RuntimeError("this package was made for another machine")
