"""Building blocks of defenses that read a network's activations: feature maps, z-scores, over-activation."""
