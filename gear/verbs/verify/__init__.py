"""The verb `verify`: every file of a dataset checked, and damaged ones made again."""
