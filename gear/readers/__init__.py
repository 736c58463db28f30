"""Readers: datasets of any task as torch wants them. Needs torch; opening a dataset without it is `gear.opening`."""

from gear.readers.batches import Batch, as_pictures, batches, collate
from gear.readers.order import order
from gear.readers.torch_dataset import Item, TorchDataset, picture_tensor

__all__ = ["Batch", "Item", "TorchDataset", "as_pictures", "batches", "collate", "order", "picture_tensor"]
