"""Export to a folder for the Hugging Face hub and its package `datasets`: Parquet files and a dataset card."""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.dataset_card import SplitFacts, card
from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree
from gear.formats.parquet_files import ParquetOptions, parquet_files

STRUCTURE = (
    "One row per sample. Pictures and label maps are columns of their own; `record` is the complete scene, `surfaces` "
    "the patch's corners and visibility, `facts` the ground truth that is no picture, all three as JSON."
)


def hf_tree(splits: Sequence[ExportSplit], read: Read, options: ParquetOptions) -> Tree:
    """The files of a dataset of any task for the Hugging Face hub, as pairs of path and bytes.

    The files are `README.md` (the dataset card) and `data/<split>-000000.parquet`, `data/<split>-000001.parquet`, ….
    `datasets.load_dataset(FOLDER)` reads the folder. The split `val` is called `validation` there.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of this layout.

    Raises:
        GearError: pyarrow is not installed.
    """
    facts = [SplitFacts.of(split.info, split.task, len(split.sidecars), split.manifest) for split in splits]
    configs = {"default": {one.name: [f"data/{one.name}-*.parquet"] for one in facts if one.samples}}
    for split in splits:
        for number, data in enumerate(parquet_files(split, read, options, with_features=True)):
            yield f"data/{split.info.split}-{number:06d}.parquet", data
    yield "README.md", card(facts, configs, STRUCTURE).encode()


LAYOUT = Layout(
    tasks=(),
    summary="Hugging Face: README.md and data/<split>-000000.parquet, … (needs pyarrow)",
    tree=hf_tree,
    options=ParquetOptions,
)
