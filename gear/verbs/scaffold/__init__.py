"""`gear new`: a complete small package for a new task, model, attack or defense."""
