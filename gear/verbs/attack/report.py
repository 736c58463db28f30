"""The result of `gear.attack`."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from gear.contracts.attacks import Patch
from gear.reporting.progress_text import plural, rate_text
from gear.values.resources import data_dir
from gear.values.serial import Json

TOWN_FILE, SCENES_FILE = "TOWN.xml", "SCENES.yml"
"""Placeholders for the files of a town that is not one of gear's, in the next command."""

TWIN_NAMES = {"none": "no patch", "random": "random patches", "patch": "these patches"}
"""Names of the twins of a drive in the summary."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class AttackReport:
    """The result of `gear.attack`.

    Attributes:
        out: the patch folder.
        patches: the optimised patches, one per surface.
        facts: content of `attack.json`: all inputs and results.
        made: True if this run made the patches; False if finished patches already existed.
    """

    out: Path
    patches: tuple[Patch, ...]
    facts: Json
    made: bool

    def summary(self) -> str:
        """Returns the result as a few lines of text."""
        done = self.facts["steps_done"]
        lines = [
            f"{self.out}: {len(self.patches)} patch{'es' * (len(self.patches) > 1)} after {done} steps"
            + (f", {rate_text(self.facts['steps_per_s'])}" if self.facts["steps_per_s"] else "")
            + ("" if self.made else " (there already)")
        ]
        if self.facts["stopped"]:
            lines.append(f"ended early: {self.facts['stopped']}")
        lines += [*self._achieved(), *self._held_out()]
        if (
            self.facts["gradient_check"] is not None
            and self.facts["gradient_check"]["measured_change"] < 0.5 * self.facts["gradient_check"]["predicted_change"]
        ):
            lines.append(
                "the objective follows its gradient only in part: gradients are masked, so a stronger attack may exist "
                "(see gradient_check in attack.json)"
            )
        foreign = "" if self._is_ours else f" ({TOWN_FILE} and {SCENES_FILE}: the files of the town)"
        lines.append(f"next: {self.next_command}{foreign}")
        return "\n".join(lines)

    @property
    def next_command(self) -> str:
        """The `gear collect` command that renders test pictures of the scene with these patches.

        Datasets store no paths, so for a town that is not one of gear's the command has placeholders for its files.
        """
        town, _, scene = self.facts["data"][0]["scene"].partition("/")
        if not self._is_ours:
            town, scene = TOWN_FILE, f"{SCENES_FILE}:{scene}"
        words = ["gear", "collect", "--task", self.facts["task"], "--scene", scene, "--split", "test", "--town", town]
        return shlex.join([*words, "--patch", str(self.out)])

    @property
    def _is_ours(self) -> bool:
        """Whether the attacked scene is in a town of gear."""
        town = self.facts["data"][0]["scene"].partition("/")[0]
        return (data_dir("mjcf") / "towns" / f"{town}.xml").is_file()

    def _achieved(self) -> list[str]:
        """Returns one line per group of samples, with the objective for random patches and for these patches."""
        lines = []
        for name, found in (self.facts.get("achieved") or {}).items():
            if found is not None and None not in (found["random"], found["patch"]):
                samples = f"{found['samples']:g} {name} {plural('sample', found['samples'])}"
                values = f"{found['random']:.4g} with random patches, {found['patch']:.4g} with these"
                lines.append(f"objective on {samples}: {values}")
        return lines

    def _held_out(self) -> list[str]:
        """Returns the result of the held-out drives, if the attack was on drives: one line per twin, and one with the
        paired test.
        """
        found = self.facts.get("held_out")
        if not found:
            return []
        lines = []
        for twin, one in found["twins"].items():
            words = [f"{one['crashes']} of {one['drives']} crashed"]
            if one["interval"] is not None:
                words[0] += " (95 % interval {:.0f} to {:.0f} %)".format(*(100 * end for end in one["interval"]))
            if one["phantoms"]:
                words.append(f"{one['phantoms']} braked hard for nothing")
            if one["least_ttc_s"] is not None:
                words.append(f"mean least time to collision {one['least_ttc_s']:.2f} s")
            if one["least_distance_m"] is not None:
                words.append(f"mean least distance {one['least_distance_m']:.2f} m")
            lines.append(f"held-out drives, {TWIN_NAMES[twin]}: {', '.join(words)}")
        against = found["against"]["random"]
        lines.append(
            f"crashes with these patches only: {against['only_here']}, with random patches only:"
            f" {against['only_there']}, McNemar's exact p {against['p']:.3f}"
        )
        return lines
