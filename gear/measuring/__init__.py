"""Parts that the verbs `evaluate`, `attack` and `gap` share: models with a defense, runs over datasets, scores,
statistics.
"""
