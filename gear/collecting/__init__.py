"""Collecting samples: jobs, patch sources, and workers with one world and one renderer each."""
