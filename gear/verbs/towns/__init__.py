"""The verb `towns`: lists of towns and their scenes, maps of towns, and thumbnails of scenes."""
