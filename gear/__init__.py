"""gear: driving datasets with physical adversarial patches in them, rendered by MuJoCo."""
