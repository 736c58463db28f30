"""The verbs: gear's main functions, such as `collect`, `train` and `attack`, one folder or module per function of
the Python API.
"""
