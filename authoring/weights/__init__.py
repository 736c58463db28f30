"""Training data, evaluation data and release of the reference weights. See `python -m authoring.weights --help`."""
