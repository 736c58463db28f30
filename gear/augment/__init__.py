"""Augmentation of training samples: pure functions from a sample and a random generator to a sample. No torch.

A task registers how its samples are mirrored and cropped (`gear.augment.registry.register`); its ground truth moves
with the pixels. Colours change for every task. Samples of a class without a registered geometry are only recoloured.
"""
