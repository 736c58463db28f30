"""Metrics: each an evaluator over a data set, by the definitions of the benchmark that it belongs to."""
