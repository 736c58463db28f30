"""The tables of the CARLA-GeAR paper for a benchmark: their cells, as HTML and as LaTeX."""
