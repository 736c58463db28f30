"""Motorcycles and bicycles with their riders, made in code: `python -m authoring.two_wheelers` writes mjcf/vehicles/."""
