"""The world: towns, actors and boards in MJCF, composed once, placed often."""
