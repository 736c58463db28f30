"""What `gear verify` reports."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

from gear.dataset.verification import Finding
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifyReport:
    """The state of a dataset.

    Attributes:
        root: its folder.
        files: how many files were checked.
        findings: files that are not as they should be; after a repair, those that still are not.
        repaired: files that a repair has made again, or deleted as leftovers.
        unrepaired: why a split could not be repaired, one line each.
    """

    root: Path
    files: int
    findings: tuple[Finding, ...]
    repaired: tuple[Finding, ...] = ()
    unrepaired: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        """Whether every file is as gear wrote it, and no other one lies among them."""
        return not self.findings

    def lines(self) -> list[str]:
        """One line for each file and each split that could not be repaired, and a last one for the whole."""
        lines = [f"repaired   {one.path}" for one in self.repaired]
        lines += [one.line() for one in self.findings]
        lines += self.unrepaired
        if self.is_whole:
            return [*lines, f"{self.root}: {self.files} files, all as they were written"]
        counts = [
            f"{count} {problem}"
            for problem in ("damaged", "missing", "unexpected")
            if (count := sum(one.problem == problem for one in self.findings))
        ]
        return [*lines, f"{self.root}: {', '.join(counts)} of {self.files} files"]

    def as_json(self) -> Json:
        """For programs."""
        return {
            "root": str(self.root),
            "files": self.files,
            "is_whole": self.is_whole,
            "findings": [asdict(one) for one in self.findings],
            "repaired": [asdict(one) for one in self.repaired],
            "unrepaired": list(self.unrepaired),
        }
