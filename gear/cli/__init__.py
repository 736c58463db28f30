"""The command line `gear`: one small file for each command, which parses arguments, calls the library and prints
results.
"""
