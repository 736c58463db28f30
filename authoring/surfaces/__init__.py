"""Surfaces that take a patch, made in code: `python -m authoring.surfaces` writes mjcf/surfaces/."""
