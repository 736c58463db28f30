"""What defenses that read a network's activations are made of: feature maps, z-scores, over-activation."""
