"""Collection of datasets: resolves a config to a job, renders the missing samples in workers, and writes them."""
