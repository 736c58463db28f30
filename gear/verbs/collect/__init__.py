"""The verb `collect`: renders one split of a dataset from a config and writes it."""
