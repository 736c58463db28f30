"""Lanes, junctions and routes of a town, seen from above."""
