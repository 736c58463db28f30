"""Augmentation of training samples: pure functions from a sample and a random generator to a new sample. The
package does not import torch.

Each task registers functions that mirror and crop its samples together with their ground truth
(`gear.augment.registry.register`). Colours are changed for the samples of all tasks. Samples of a class without
registered functions are only recoloured.
"""
