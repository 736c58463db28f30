"""Discovery and building of plugins, and the built-in tasks, models, attacks and defenses, one file each."""
