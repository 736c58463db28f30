"""Discovery and building of plugins, and the built-in plugins of all kinds, one file each."""
