"""The command line `gear`: each command has one small module, which parses arguments, calls the library and prints
the result.
"""
