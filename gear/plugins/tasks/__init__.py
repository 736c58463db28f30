"""Tasks that gear brings, one file each."""
