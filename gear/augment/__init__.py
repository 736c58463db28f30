"""Augmentation of training samples: pure functions from a sample and a generator to a sample. No torch.

What moves pixels moves the ground truth with them, exactly; what changes colours alone works for every task. A third
party's samples are moved if its package says how (`gear.augment.registry.register`), and otherwise only coloured.
"""
