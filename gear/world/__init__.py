"""The world: a town with actors and boards, composed from MJCF files and compiled once.

Each sample then only moves actors and changes patches.
"""
