"""The verb `evaluate`: measures a model, with or without a defense, on datasets of its task."""
