"""The results of a comparison of composed patches (pasted into clean pictures) and rendered patches, as JSON and
as a table.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gear.contracts.defenses import FitReport
from gear.measuring.gap.effect import CLEAN, RENDERED, Metrics, SampleEffect
from gear.measuring.gap.picture_gap import PictureGap
from gear.values.serial import Json, to_json

UNMOVED = 1e-9
"""Changes of a metric up to this size count as no change, so the share rendered / composed is not computed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleGap:
    """The comparison of one picture that shows a patch.

    Attributes:
        index, view: index of the sample and name of the camera.
        visible_px: number of pixels that show a patch.
        distance_m: distance from the camera to the nearest visible surface.
        incidence_deg: largest angle between the line of sight and the normal of a visible surface.
        gaps: difference between the picture with the composed (pasted) and with the rendered patch, by compositor.
    """

    index: int
    view: str
    visible_px: int
    distance_m: float
    incidence_deg: float
    gaps: Mapping[str, PictureGap]


@dataclass(frozen=True, slots=True, kw_only=True)
class GapReport:
    """The comparison of composed patches (pasted into clean pictures) and rendered patches on one split.

    Attributes:
        dataset, twin: roots of the clean dataset and of the same dataset rendered with the patch.
        split, patch, renderer, quality: split, label of the patch, renderer and render quality of the pictures.
        samples: comparisons of the pictures that show a patch; other pictures are left out.
        effect: the task's metrics by name, for `clean`, each compositor and `rendered`; empty without a model.
        sample_effects: changes of the metrics of single samples.
        metric: name of the metric in the table of single samples.
        model: name of the model; None without a model.
        defense: name of the model's defense; None without a defense.
        seed: seed of the defense's random draws.
        fit: the defense's summary of its calibration; None if it provides none.
    """

    dataset: str
    twin: str
    split: str
    patch: str
    renderer: str
    quality: str
    samples: tuple[SampleGap, ...]
    effect: Mapping[str, Metrics]
    sample_effects: tuple[SampleEffect, ...] = ()
    metric: str = ""
    model: str | None
    defense: str | None = None
    seed: int = 0
    fit: FitReport | None = None

    def median_db(self, compositor: str) -> float:
        """The median PSNR in dB over all pictures that show a patch; NaN if there are none.

        Args:
            compositor: name of the compositor whose pictures are compared with the rendered ones.
        """
        values = [sample.gaps[compositor].psnr_db for sample in self.samples]
        return float(np.median(values)) if values else math.nan

    @property
    def compositors(self) -> tuple[str, ...]:
        """The names of the compared compositors; empty if no picture shows a patch."""
        return tuple(self.samples[0].gaps) if self.samples else ()

    def kept(self, compositor: str) -> dict[str, float]:
        """The share of a patch's effect that remains when the patch is rendered instead of composed, by metric.

        The share is (rendered - clean) / (composed - clean). Metrics that the composed patch does not change are left
        out.

        Args:
            compositor: name of the compositor that made the composed pictures.

        Returns:
            The shares by metric; 1 means that the whole effect remains. Empty if no network was evaluated.
        """
        if not self.effect:
            return {}
        clean, digital, rendered = self.effect[CLEAN], self.effect[compositor], self.effect[RENDERED]
        return {
            name: (rendered[name] - clean[name]) / (digital[name] - clean[name])
            for name in clean
            if name in digital and name in rendered and abs(digital[name] - clean[name]) > UNMOVED
        }

    def as_json(self) -> Json:
        """All fields as JSON, with the median PSNR (`median_psnr_db`) and the remaining share of the effect
        (`rendered_share_of_digital_effect`) of each compositor; numbers that are not finite become null.
        """
        content = to_json(self)
        content["median_psnr_db"] = {name: self.median_db(name) for name in self.compositors}
        content["rendered_share_of_digital_effect"] = {name: self.kept(name) for name in self.compositors}
        return _finite(content)

    def table(self) -> str:
        """The report as a plain-text table."""
        names = self.compositors
        lines = [f"{self.dataset} {self.split}: {self.patch}, {self.renderer} {self.quality}; PSNR inside the patch"]
        head = f"{'sample':>6} {'view':8}{'pixels':>8}{'m':>6}{'slant':>6}"
        lines.append(head + "".join(f"{name + ' dB':>16}{'worst':>7}{'outside':>9}" for name in names))
        for s in self.samples:
            row = f"{s.index:6} {s.view:8}{s.visible_px:8}{s.distance_m:6.1f}{s.incidence_deg:6.0f}"
            lines.append(row + "".join(_cells(s.gaps[name]) for name in names))
        if names:
            lines.append(f"{'median':34}" + "".join(f"{self.median_db(name):16.1f}{'':16}" for name in names))
        else:
            lines.append("no picture shows a patch")
        return "\n".join(lines + self._sample_lines() + self._effect_lines())

    def shown_metric(self) -> str:
        """The metric in the table of single samples: the task's main metric, or the first one with a finite value;
        empty if there is none.
        """
        known = [name for one in self.sample_effects for name, value in one.clean.items() if math.isfinite(value)]
        return self.metric if self.metric in known else next(iter(known), "")

    def _sample_lines(self) -> list[str]:
        """Rows with the changes of one metric by sample, and their means over the samples that have it."""
        metric = self.shown_metric()
        if not metric:
            return []
        columns = list(self.sample_effects[0].change)
        head = f"{'sample':>6} {metric:>17}" + "".join(f"{name:>14}" for name in columns)
        lines = ["", head + "   change with the patch"]
        rows = [
            (one.index, [one.clean.get(metric, math.nan), *(one.change[name][metric] for name in columns)])
            for one in self.sample_effects
            if metric in one.clean
        ]
        lines += [f"{index:6} {_numbers(values)}" for index, values in rows]
        whole = [values for _, values in rows if np.isfinite(values).all()]
        if whole:
            lines.append(f"{'mean':>6} {_numbers(np.mean(whole, axis=0).tolist())}")
        return lines

    def _effect_lines(self) -> list[str]:
        if not self.effect:
            return []
        columns = list(self.effect)
        whose = f"{self.model or ''}{f' behind {self.defense}' if self.defense else ''}"
        lines = ["", f"{whose:28}" + "".join(f"{name:>14}" for name in columns) + "   rendered / digital"]
        shares = {name: self.kept(name) for name in self.compositors}
        for metric in self.effect[CLEAN]:
            values = "".join(f"{self.effect[name].get(metric, math.nan):14.4f}" for name in columns)
            share = "".join(f"  {name} {share[metric]:.2f}" for name, share in shares.items() if metric in share)
            lines.append(f"{metric:28}{values}{share}")
        if self.fit is not None:
            values = ", ".join(f"{name} {value:.4g}" for name, value in self.fit.values.items())
            lines.append(f"{self.defense} learnt, on its own calibration data: {values}")
            lines += [f"WARNING: {problem}" for problem in self.fit.problems]
        return lines

    def summary(self) -> str:
        """The number of pictures and the median PSNR of each compositor, as one line of text."""
        found = ", ".join(f"{name} {self.median_db(name):.1f} dB" for name in self.compositors)
        return f"{len(self.samples)} pictures with a patch: {found or 'none'}"


def _cells(gap: PictureGap) -> str:
    return f"{gap.psnr_db:16.1f}{gap.worst:7}{gap.outside_worst:9}"


def _numbers(values: Sequence[float]) -> str:
    """A sample's metric and its changes as text; `-` where there is none."""
    first, *changes = [
        f"{value:{sign}.4f}" if math.isfinite(value) else "-"
        for sign, value in zip(["", *"+" * (len(values) - 1)], values, strict=True)
    ]
    return f"{first:>17}" + "".join(f"{text:>14}" for text in changes)


def _finite(value: Json) -> Json:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
