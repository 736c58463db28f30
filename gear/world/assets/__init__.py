"""The MJCF files of towns, actors and boards: finding them by name, and reading their metadata, labels and
triangles.
"""
