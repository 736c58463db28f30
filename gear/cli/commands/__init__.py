"""The commands of `gear`: each command is one module with two functions.

`add_arguments` adds the command's flags to a parser. `run` calls the library, prints the result and returns the exit
code.
"""
