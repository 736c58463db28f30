"""Built-in attacks, one file each; their shared building blocks are in `optimisation`."""
