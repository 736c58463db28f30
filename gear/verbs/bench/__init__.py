"""`gear bench`: patches, networks and defenses compared over scenes, as one run."""
