"""Compares patches pasted into clean pictures by a compositor with the same patches rendered: by pixels, and by
their effect on a model.
"""
