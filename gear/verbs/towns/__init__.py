"""Towns and their scenes: lists, maps and thumbnails."""
