"""Shared parts of the verbs that measure models: guarded models, runs over datasets, scores and statistics."""
