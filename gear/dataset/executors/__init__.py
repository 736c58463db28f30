"""Executors, which make the samples of a job. Each engine is one module with a class that implements `Executor`."""
