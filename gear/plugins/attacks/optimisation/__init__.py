"""What attack plugins are made of: objectives, transforms, regularisers and optimisation loops, in torch."""
