"""Semantic segmentation networks and their losses."""
