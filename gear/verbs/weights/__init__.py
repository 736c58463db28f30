"""Weights files: converting published ones, averaging, and reading their metadata."""
