"""Executors, which run the items of a job. Each engine is one module that implements `Executor`."""
