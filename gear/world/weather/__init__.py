"""Weather: presets, sun and sky, air, wet ground, and lamps at night."""
