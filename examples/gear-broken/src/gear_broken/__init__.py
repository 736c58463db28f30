"""Plugins that are broken on purpose, one in each module."""
