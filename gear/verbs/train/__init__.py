"""`gear.train`: any task with any network that has losses."""
