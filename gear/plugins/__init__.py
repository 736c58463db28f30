"""Plugins: their discovery, and the built-in tasks, models, attacks and defenses, one file each."""
