"""Towns: street network, ground, buildings, furniture and lanes, written as one MJCF file.

`python -m authoring.towns town10` writes mjcf/towns/town10.xml and its meshes, the same bytes each time.
"""
