"""Weather: presets, sun and sky, fog and rain, wet ground, and lamps at night."""
