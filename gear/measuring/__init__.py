"""What verbs share when they measure a model: guarded models, runs over datasets, scores and statistics."""
