"""Monocular depth networks and their losses."""
