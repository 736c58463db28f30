"""The verb `leaderboard`: checks records of results by measuring again, and builds the pages of a leaderboard."""
