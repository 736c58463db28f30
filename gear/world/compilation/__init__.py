"""Compiles MJCF files to MuJoCo models, and keeps compiled worlds in a cache."""
