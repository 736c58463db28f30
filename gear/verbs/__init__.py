"""The verbs: each is one call of the Python API, shows progress, and resumes an interrupted run."""
