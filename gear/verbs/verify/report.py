"""The result of `gear.verify`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

from gear.dataset.checks.verification import Finding, Problem
from gear.plugins.text import LONGEST_LINE, printable
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifyReport:
    """The result of `gear.verify`: the state of a dataset's files.

    Attributes:
        root: root of the dataset.
        files: number of files of the dataset, with those that cannot be checked.
        findings: files that are damaged, missing or unexpected, or cannot be checked; after a repair, only those that
            could not be repaired.
        repaired: files that were made again, or deleted as leftovers of an interrupted run.
        unrepaired: one line with the reason for each split that could not be repaired.
        notes: one line for each repaired split whose new files may differ from the original ones.
    """

    root: Path
    files: int
    findings: tuple[Finding, ...]
    repaired: tuple[Finding, ...] = ()
    unrepaired: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        """Whether every file has the content that gear wrote, and there are no unexpected files."""
        return not self.findings

    def lines(self) -> list[str]:
        """Returns one line per repaired or faulty file, one per split that could not be repaired, the notes,
        and a summary line.

        Names of files may come from another person, so control characters, such as terminal escapes, are escaped.
        """
        return [printable(line, LONGEST_LINE) for line in self._raw_lines()]

    def _raw_lines(self) -> list[str]:
        lines = [f"repaired   {one.path}" for one in self.repaired]
        lines += [one.line() for one in self.findings]
        lines += [*self.unrepaired, *self.notes]
        if self.is_whole:
            return [*lines, f"{self.root}: {self.files} files, all as they were written"]
        counts = [
            f"{count} {problem}"
            for problem in get_args(Problem)
            if (count := sum(one.problem == problem for one in self.findings))
        ]
        return [*lines, f"{self.root}: {', '.join(counts)} of {self.files} files"]

    def as_json(self) -> Json:
        """Returns the fields of the report as JSON, and `is_whole`."""
        return {
            "root": str(self.root),
            "files": self.files,
            "is_whole": self.is_whole,
            "findings": [asdict(one) for one in self.findings],
            "repaired": [asdict(one) for one in self.repaired],
            "unrepaired": list(self.unrepaired),
            "notes": list(self.notes),
        }
