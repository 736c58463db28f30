"""The verb `defend`: the pictures of a dataset as a defense cleans them."""
