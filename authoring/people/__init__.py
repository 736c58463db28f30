"""People, made in code: `python -m authoring.people` writes mjcf/pedestrians/."""
