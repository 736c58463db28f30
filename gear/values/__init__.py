"""Value types that all other packages exchange: frozen dataclasses, typed, with units and frames in the names.
Depends on NumPy only.
"""
