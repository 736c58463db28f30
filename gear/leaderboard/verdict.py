"""The verdict of a check on a record: one JSON file per record, which only the maintainers of a leaderboard write.

The verdicts lie in a folder of their own. What a record says about itself never counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from gear.leaderboard.field_checks import LONGEST_TEXT, check_sha256, check_text
from gear.leaderboard.reading import limited, read_as
from gear.leaderboard.record import canonical
from gear.values.errors import FieldError
from gear.values.serial import Json, to_json

FORMAT, VERSION = "gear-check", 1
MOST_BYTES = 1 << 20

State = Literal["reproduced", "differs", "incomplete"]
Level = Literal["same", "note", "differs"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One line of a check.

    Attributes:
        level: `differs` contradicts the record, `note` is worth knowing, `same` confirms.
        text: what was compared, and the result.
    """

    level: Level
    text: str

    def __post_init__(self) -> None:
        check_text("text", self.text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The result of a check.

    Attributes:
        record_sha256: SHA-256 of the record's file.
        state: `reproduced`, `differs`, or `incomplete` if the check did not compute the ranked metric again.
        seed: seed by which the check chose samples.
        repeated, fresh: number of samples that were measured again, and of samples that are not part of the benchmark.
        environment: versions, renderer and device of the check.
        findings: one line per comparison.
    """

    record_sha256: str
    state: State
    seed: int
    repeated: int
    fresh: int
    environment: dict[str, str]
    findings: tuple[Finding, ...]

    def __post_init__(self) -> None:
        check_sha256("record_sha256", self.record_sha256)
        if len(self.findings) > 1000:
            raise FieldError("findings", "has more than 1000 entries")

    def as_json(self) -> Json:
        """The content of the verdict's file: all fields, with `format` and `version`."""
        return {"format": FORMAT, "version": VERSION, **to_json(self)}

    def encoded(self) -> bytes:
        """The bytes of the verdict's file."""
        return canonical(self.as_json())


def finding(level: Level, text: str) -> Finding:
    """A finding whose text is made printable and cut to the allowed length.

    Args:
        level: `same`, `note`, or `differs`; only `differs` speaks against the record.
        text: the finding; line breaks become spaces.
    """
    line = "".join(mark if mark.isprintable() else "?" for mark in " ".join(text.split()))
    return Finding(level=level, text=line if len(line) <= LONGEST_TEXT else line[: LONGEST_TEXT - 3] + "...")


def read_verdict(path: Path) -> Verdict:
    """Reads the verdict of a check from the JSON file `path`.

    Raises:
        DatasetError: the file cannot be read, or is no verdict.
    """
    verdict: Verdict = read_as(Verdict, limited(path, MOST_BYTES), path, FORMAT, VERSION)
    return verdict
