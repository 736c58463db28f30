"""The command line: one small file per command, which parses arguments, calls the library and prints."""
