"""Encodes the samples of a split as Parquet files: one row per sample.

Columns are the files of a sample and the parts of its sidecar (its JSON file).
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from gear.formats.exports.layout import ExportSplit, Read, check_range
from gear.formats.sample_parts import column_of, parts_of
from gear.values.errors import DatasetError, GearError
from gear.values.serial import Json, to_json

NUMBERS = ("index", "sequence", "frame")
TEXTS = ("record", "surfaces", "facts")
PICTURES = ("png", "tiff", "tif", "jpg", "jpeg")
TEXT_SUFFIXES = ("txt", "json", "csv")

REMEDY = "export the dataset to `webdataset`, which keeps files as they are"

ROWS = 100
"""Number of rows in a row group, the part of a Parquet file that readers load at once."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ParquetOptions:
    """Options of the layouts that write Parquet files.

    Attributes:
        shard_mb: largest size of the samples in one Parquet file, in megabytes (10^6 bytes), 0.01 to 10000. A file with
            a single sample may be larger.
    """

    shard_mb: float = 256.0

    def __post_init__(self) -> None:
        check_range("shard_mb", self.shard_mb, 0.01, 10_000)


def pyarrow_parquet() -> tuple[ModuleType, ModuleType]:
    """The modules `pyarrow` and `pyarrow.parquet`.

    Raises:
        GearError: the package is not installed.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        problem = "this layout needs pyarrow: pip install 'mujoco-gear[export]', with the versions of constraints.txt"
        raise GearError(problem) from error
    return pyarrow, parquet


def parquet_files(
    split: ExportSplit, read: Read, options: ParquetOptions, *, with_features: bool = False
) -> Iterator[bytes]:
    """The Parquet files of one split, as bytes, in order.

    Columns are `index`, `sequence` and `frame`; the JSON texts `record`, `surfaces` and `facts` of the sidecar; and one
    column for each file of a sample (`gear.formats.sample_parts`). The cells of a file's column are text for text
    files, otherwise bytes.

    Args:
        split: a finished split of any task.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of the layout.
        with_features: whether pictures are written as `{bytes, path}` and the file describes its columns to the package
            `datasets`, which then decodes the pictures.

    Raises:
        GearError: pyarrow is not installed.
    """
    pyarrow_parquet()
    name = split.info.split
    found = {(part.name, part.suffix) for sidecar in split.sidecars for part in parts_of(sidecar, name)}
    columns = {column_of(part, suffix, found): suffix for part, suffix in sorted(found)}
    rows: list[dict[str, Any]] = []
    size = 0
    for sidecar in split.sidecars:
        row: dict[str, Any] = {key: getattr(sidecar.record, key) for key in NUMBERS}
        row |= {
            "record": _text(to_json(sidecar.record)),
            "surfaces": _text(to_json(sidecar.surfaces)),
            "facts": _text(sidecar.facts),
        }
        added = 0
        for part in parts_of(sidecar, name):
            data = read(part.path)
            added += len(data)
            row[column_of(part.name, part.suffix, found)] = _value(data, part.path, part.suffix, with_features)
        if rows and size + added > options.shard_mb * 1e6:
            yield _file(rows, columns, with_features)
            rows, size = [], 0
        rows.append(row)
        size += added
    if rows:
        yield _file(rows, columns, with_features)


def _text(content: Json) -> str:
    return json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _value(data: bytes, path: str, suffix: str, with_features: bool) -> Any:
    if suffix in TEXT_SUFFIXES:
        try:
            return data.decode()
        except UnicodeDecodeError as error:
            raise DatasetError(path, f"is no text in UTF-8 (byte {error.start}); {REMEDY}") from error
    return {"bytes": data, "path": path} if with_features and suffix in PICTURES else data


def _file(rows: Sequence[dict[str, Any]], columns: dict[str, str], with_features: bool) -> bytes:
    """One Parquet file."""
    pyarrow, parquet = pyarrow_parquet()
    fields = [(key, pyarrow.int64()) for key in NUMBERS]
    picture = pyarrow.struct([("bytes", pyarrow.binary()), ("path", pyarrow.string())])
    for column, suffix in columns.items():
        if suffix in TEXT_SUFFIXES:
            fields.append((column, pyarrow.string()))
        else:
            fields.append((column, picture if with_features and suffix in PICTURES else pyarrow.binary()))
    fields += [(key, pyarrow.string()) for key in TEXTS]
    schema = pyarrow.schema(fields)
    if with_features:
        schema = schema.with_metadata({"huggingface": _text({"info": {"features": features(columns)}})})
    stream = io.BytesIO()
    table = pyarrow.Table.from_pylist(list(rows), schema=schema)
    # Pictures are compressed already; the package's own dictionaries would only make a second copy of them.
    parquet.write_table(table, stream, row_group_size=ROWS, compression="zstd", use_dictionary=False)
    return stream.getvalue()


def features(columns: dict[str, str]) -> Json:
    """The description of columns that the package `datasets` reads from a Parquet file: the type of each column.

    Args:
        columns: file suffix of each column that holds files, by the column's name.

    Returns:
        The JSON value for `info.features` in the metadata `huggingface` of the Parquet file.
    """
    described: dict[str, Json] = {key: {"dtype": "int64", "_type": "Value"} for key in NUMBERS}
    for column, suffix in columns.items():
        if suffix in PICTURES:
            described[column] = {"_type": "Image"}
        else:
            dtype = "string" if suffix in TEXT_SUFFIXES else "binary"
            described[column] = {"dtype": dtype, "_type": "Value"}
    return described | {key: {"dtype": "string", "_type": "Value"} for key in TEXTS}
