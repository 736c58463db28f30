"""The commands of `gear`, one file for each.

`add_arguments` adds the command's flags to a parser. `run` calls the library, prints the result and returns the exit
code.
"""
