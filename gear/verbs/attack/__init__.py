"""`gear attack`: patches for any task and model."""
