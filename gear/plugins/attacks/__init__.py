"""Built-in attacks, one file each; what they are made of lies in `optimisation`."""
