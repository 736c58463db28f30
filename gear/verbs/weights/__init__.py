"""Weights on disk: published files made into gear's, and what a file says of itself."""
