"""Folders at addresses of fsspec, such as `s3://bucket/folder`, to which finished datasets and exports are written."""
