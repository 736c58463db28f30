"""Records of benchmark results, the rules that they must keep, and the leaderboard that they make."""
