"""The verb `defend`: applies a defense to the pictures of a dataset and writes the cleaned pictures."""
