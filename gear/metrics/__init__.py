"""Metrics of the tasks. Each evaluator gathers samples and predictions of a dataset and follows the definitions of
a benchmark.
"""
