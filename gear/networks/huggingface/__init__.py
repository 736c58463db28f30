"""Networks of the transformers package, opened from a folder with its weights and configuration."""
