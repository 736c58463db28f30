"""Export to Parquet files with one row per sample, in which pictures are stored as bytes."""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree
from gear.formats.parquet_files import ParquetOptions, parquet_files


def parquet_tree(splits: Sequence[ExportSplit], read: Read, options: ParquetOptions) -> Tree:
    """The Parquet files `<split>-000000.parquet`, `<split>-000001.parquet`, … of a dataset of any task.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of this layout.

    Raises:
        GearError: pyarrow is not installed.
    """
    for split in splits:
        for number, data in enumerate(parquet_files(split, read, options)):
            yield f"{split.info.split}-{number:06d}.parquet", data


LAYOUT = Layout(
    tasks=(),
    summary="Parquet: <split>-000000.parquet, …, one row per sample (needs pyarrow)",
    tree=parquet_tree,
    options=ParquetOptions,
)
