"""Datasets on disk: file layout, sidecars (JSON files of samples), manifests, atomic writes, resuming and reading."""
