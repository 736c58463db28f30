"""Checks of files against their hashes, of the values in sidecars, and of what plugins return."""
