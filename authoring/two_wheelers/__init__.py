"""Motorcycles and bicycles with their riders, in code: `python -m authoring.two_wheelers` writes mjcf/vehicles/."""
