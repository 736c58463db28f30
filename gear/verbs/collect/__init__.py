"""The verb `collect`: a config becomes a dataset split on disk."""
