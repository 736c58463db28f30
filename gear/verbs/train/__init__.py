"""The verb `train`: trains networks for any task; the network's plugin supplies the losses."""
