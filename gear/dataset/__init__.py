"""Datasets on disk: atomic writes, sidecars, manifests, resuming, twins and readers."""
