"""gear's own loggers, one per module, for `--log-to`."""
