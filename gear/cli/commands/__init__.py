"""Commands of `gear`, one file each: `add_arguments` adds the flags, `run` calls the library and prints."""
