"""`gear.train`: trains networks that have losses, for any task."""
