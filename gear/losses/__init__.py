"""Task losses, in torch: for training and for attacks."""
