"""The verbs: each is one call of the Python API, shows progress and can be taken up again."""
