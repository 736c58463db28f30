"""The verb `collect`: renders and writes a dataset split from a config."""
