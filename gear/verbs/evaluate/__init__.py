"""`gear evaluate`: a model, with or without a defense, over datasets of its task."""
