"""Writes the files of a patch folder: pictures to print, exact values, figures, and a record of the attack."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from safetensors.numpy import save as to_bytes

from gear.collecting.patch_sources import as_printed
from gear.contracts.attacks import Patch
from gear.dataset.files import write_whole
from gear.dataset.json_text import dump_json
from gear.formats.png import encode_rgb
from gear.values.frames import UInt8Image
from gear.values.serial import Json
from gear.verbs.attack.curve_titles import HELD_OUT, curve_title

BLUE, RED, GREY = "#1f5fa8", "#b3402a", "0.55"


def write_patches(root: Path, patches: Sequence[Patch], notes: Json) -> None:
    """Writes `patch_0.png`, …, then `patch.safetensors`, and last `attack.json`, which marks the folder as complete.

    Args:
        root: the patch folder.
        patches: patches of the attack, one per surface.
        notes: content of `attack.json`.
    """
    for patch in patches:
        write_whole(root, f"{patch.name}.png", encode_rgb(as_picture(patch)))
    exact = {patch.name: np.ascontiguousarray(patch.rgb, np.float32) for patch in patches}
    write_whole(root, "patch.safetensors", to_bytes(exact))
    write_whole(root, "attack.json", dump_json(notes))


def as_picture(patch: Patch) -> UInt8Image:
    """Returns a patch as a printable (H, W, 3) uint8 sRGB picture."""
    return as_printed(patch.rgb)


def write_curves(
    root: Path, title: str, curves: Mapping[str, Sequence[float]], judged: Sequence[tuple[int, float]]
) -> None:
    """Writes `figures/curves.png`: every recorded value over the steps, and the
    objective on the validation samples. Titles state which direction is better.

    Args:
        root: the patch folder.
        title: title of the figure.
        curves: recorded values of all steps, by name.
        judged: step and harm of each validation.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = [name for name, values in curves.items() if np.isfinite(values).any()]
    panels = len(names) + bool(judged)
    figure = Figure(figsize=(3.2 * max(panels, 1), 2.8), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontsize=9)
    axes = np.atleast_1d(figure.subplots(1, max(panels, 1)))
    for axis, name in zip(axes, names, strict=False):
        values = np.asarray(curves[name], np.float64)
        axis.plot(np.arange(1, len(values) + 1), values, color=GREY, lw=0.6)
        axis.plot(*_smoothed(values), color=BLUE, lw=1.4)
        axis.set_title(_in_two_lines(curve_title(name)), fontsize=8)
    if judged:
        axes[-1].plot(*np.transpose(judged), "o-", color=RED, ms=3)
        axes[-1].set_title(_in_two_lines(curve_title(HELD_OUT)), fontsize=8)
    for axis in axes:
        axis.tick_params(labelsize=7)
        axis.set_xlabel("step", fontsize=7)
        axis.grid(alpha=0.3)
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=120, metadata={"Software": None})
    write_whole(root, "figures/curves.png", data.getvalue())


def write_samples(root: Path, figure: UInt8Image) -> None:
    """Writes `figures/samples.png`: samples without and with patches, with predictions and ground truth.

    Args:
        root: the patch folder.
        figure: (H, W, 3) uint8 RGB.
    """
    write_whole(root, "figures/samples.png", encode_rgb(figure))


def _in_two_lines(title: str) -> str:
    """Returns a title with the direction on a line of its own."""
    return title.replace(" (", "\n(")


def _smoothed(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the steps and the values, each as a moving average over a twentieth of the steps."""
    known = np.isfinite(values)
    width = max(1, int(known.sum()) // 20)
    kernel = np.ones(width) / width
    steps = np.flatnonzero(known) + 1
    return np.convolve(steps, kernel, "valid"), np.convolve(values[known], kernel, "valid")
