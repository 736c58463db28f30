"""Plugins: how they are found, and the ones that gear brings. One file each in tasks, models, attacks, defenses."""
