"""Lanes, junctions and routes of a town, on the ground plan."""
