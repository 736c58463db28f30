"""Drives in a benchmark: steps, results and records."""
