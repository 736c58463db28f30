"""The result of an attack."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.contracts.attacks import Patch
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AttackReport:
    """The result of an attack.

    Attributes:
        out: the patch folder.
        patches: patches, one per surface.
        facts: content of `attack.json`.
        made: whether this run made the patches; False where they were there already.
    """

    out: Path
    patches: tuple[Patch, ...]
    facts: Json
    made: bool

    def summary(self) -> str:
        """The result as a few lines of text."""
        done = self.facts["steps_done"]
        lines = [
            f"{self.out}: {len(self.patches)} patch{'es' * (len(self.patches) > 1)} after {done} steps"
            + (f", {self.facts['steps_per_s']:.2f} a second" if self.facts["steps_per_s"] else "")
            + ("" if self.made else " (there already)")
        ]
        if self.facts["stopped"]:
            lines.append(f"ended early: {self.facts['stopped']}")
        if (
            self.facts["masking"] is not None
            and self.facts["masking"]["kept"] < 0.5 * self.facts["masking"]["promised"]
        ):
            lines.append(
                "the objective follows its gradient only in part: gradients are masked, so a stronger attack may exist "
                "(see masking in attack.json)"
            )
        return "\n".join(lines)
