"""Building blocks of attack plugins: objectives, transforms, regularisers and optimisation loops, in torch."""
