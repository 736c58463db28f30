"""Defenses that wrap a network and call it several times per picture: ObjectSeeker."""
