"""From MJCF files to compiled MuJoCo models, and the cache that keeps them."""
