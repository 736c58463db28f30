"""Testing: contracts and fixtures for plugin authors. Public API; needs pytest for the contracts alone."""
