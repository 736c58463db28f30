"""The verb `verify`: compares every file of a dataset with its recorded hash, and can make damaged files again."""
