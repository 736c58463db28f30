"""How verbs show that they work: bars on a terminal and in notebooks, plain lines everywhere else."""
