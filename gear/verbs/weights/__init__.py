"""The verb `weights`: converts published weights files, averages two weights files, and reads their metadata."""
