"""Networks of the transformers package, opened from a local folder that holds their weights and configuration."""
