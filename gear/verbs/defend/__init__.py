"""The verb `defend`: writes the pictures of a dataset after a defense has cleaned them."""
