"""Formats: bytes and text of the file formats that the field uses, and back. Pure functions; nothing here touches a
disk."""
