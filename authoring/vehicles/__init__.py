"""The vehicles, modelled in code: `python -m authoring.vehicles` writes all of `mjcf/vehicles/`."""
