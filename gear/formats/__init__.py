"""File formats: pure functions that encode and decode the bytes and text of datasets. Nothing here touches a disk."""
