"""Datasets on disk: whole files or none, sidecars, manifests, resuming, twins, readers."""
