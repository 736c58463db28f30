"""The world: a town with actors and boards, composed from MJCF files and compiled once; each sample then only
moves actors and changes patches.
"""
