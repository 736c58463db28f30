"""The verb `bench`: compares networks, defenses and patches over several scenes in one run."""
