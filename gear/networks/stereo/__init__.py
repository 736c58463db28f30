"""Stereo 3D detection networks and their losses."""
