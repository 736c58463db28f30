"""Networks: torch modules with the parameter names of the published weights, their losses, and weights files."""
