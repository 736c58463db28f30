"""Values: what every other room speaks in. NumPy only; frozen, typed, with units and frames in their names."""
