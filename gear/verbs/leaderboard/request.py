"""The arguments of `gear.check_record` as a dataclass."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.values.errors import GearError
from gear.values.rng import check_seed


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckRequest:
    """The arguments of `gear.check_record`.

    Attributes:
        record: file of the record.
        work: folder for the data that are made.
        out: folder that gets the verdict; None writes none.
        patches: folder with the patches; None for `patches` beside the record.
        samples, fresh: numbers of samples that are measured again, and of samples that are not part of the benchmark,
            for each kind of patch.
        drives: number of drives that are made again.
        seed: seed by which samples and drives are chosen.
        settings: `KEY=VALUE` texts that replace keys of the record's config, such as paths of files.
        withheld, commitment: file with withheld scenes, and its published salted hash; both or none.
        most_pictures: largest number of pictures that are rendered.
        device: device of the networks; None for that of the config.

    Raises:
        GearError: a number is out of range, or a commitment is given without the withheld scenes.
    """

    record: str | Path
    work: str | Path
    out: str | Path | None = None
    patches: str | Path | None = None
    samples: int = 4
    fresh: int = 8
    drives: int = 2
    seed: int = 0
    settings: tuple[str, ...] = ()
    withheld: str | Path | None = None
    commitment: str | None = None
    most_pictures: int = 2000
    device: str | None = None

    def __post_init__(self) -> None:
        check_seed(self.seed)
        if min(self.samples, self.drives, self.most_pictures) < 1 or self.fresh < 0:
            raise GearError("samples, drives and most-pictures must be at least 1, and fresh at least 0")
        if (self.commitment is None) != (self.withheld is None):
            raise GearError("withheld scenes and their commitment belong together: give both or none")
