"""gear's networks: torch modules with the parameter names of the published weights, their losses, and their
weights files.
"""
