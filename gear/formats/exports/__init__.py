"""Layouts that `gear export` writes: each module here, but `layout` and `registry`, is one, with its `LAYOUT`."""
