"""Comparison of composed and rendered patches: as pictures, and by their effect on a model."""
