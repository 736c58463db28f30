"""Shards (the parts of a split that several runs make), and merging them into one dataset."""
