"""Readers that give datasets of any task to torch: as torch datasets, and as batches.

This package needs torch; `gear.plugins.datasets` opens a dataset without torch.
"""

from gear.readers.batches import Batch, as_pictures, batches, collate, stacked
from gear.readers.find_splits import open_all
from gear.readers.in_memory import Kept
from gear.readers.order import order
from gear.readers.prefetch import read_ahead
from gear.readers.samples import Samples, all_of
from gear.readers.torch_dataset import Change, Item, TorchDataset, picture_tensor

__all__ = [
    "Batch",
    "Change",
    "Item",
    "Kept",
    "Samples",
    "TorchDataset",
    "all_of",
    "as_pictures",
    "batches",
    "collate",
    "open_all",
    "order",
    "picture_tensor",
    "read_ahead",
    "stacked",
]
