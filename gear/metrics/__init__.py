"""Metrics: evaluators over a dataset, each by the definitions of its benchmark."""
