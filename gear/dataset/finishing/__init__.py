"""What a run writes when a split is complete: the manifest's entries, and the dataset card with its metadata."""
