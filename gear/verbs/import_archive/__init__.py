"""`gear.import_archive`: unpacks a dataset from an archive and checks it."""
