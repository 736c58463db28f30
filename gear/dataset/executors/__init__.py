"""Executors: where the missing items of a job are made. Each engine is one module that implements `Executor`."""
