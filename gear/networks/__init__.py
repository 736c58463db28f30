"""Networks: torch graphs under their official keys, their losses, and their weights on disk."""
