"""The verb `verify`: checks every file of a dataset, and can make damaged files again."""
