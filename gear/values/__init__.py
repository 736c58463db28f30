"""Values that all other packages exchange: frozen, typed, with units and frames in their names. NumPy only."""
