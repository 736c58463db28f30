"""File formats: pure functions that encode and decode the bytes and text of datasets. No function here reads or writes
files.
"""
