"""The MJCF files of towns, actors and boards: finding them by name, reading their facts, labels and triangles."""
