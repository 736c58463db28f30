"""2D detection networks and their losses."""
