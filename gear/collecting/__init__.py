"""What collects samples: jobs, patch sources, sessions (one world and renderer a worker), workers."""
