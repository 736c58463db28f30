"""`gear.doctor`: checks which renderers work on this machine, and with which device and driver."""

from __future__ import annotations

import dataclasses
import platform
from dataclasses import dataclass
from importlib import metadata

from gear.render.probing import probe
from gear.render.registry import RENDERERS, describe
from gear.values.errors import BackendError
from gear.values.machine import cores
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, kw_only=True)
class RendererCheck:
    """The result of the check of one renderer, which renders a small reference frame.

    Attributes:
        name: raster, filament or classic.
        works: whether the renderer returned the frame.
        facts: JSON with a description, and either device, driver and times in seconds, or `problem` and `remedy`.
    """

    name: str
    works: bool
    facts: Json


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorReport:
    """The results of all renderers on this machine.

    Attributes:
        machine: versions of gear, Python and MuJoCo, the system, and the number of usable cores; JSON.
        renderers: one check per renderer.
    """

    machine: Json
    renderers: tuple[RendererCheck, ...]

    @property
    def works(self) -> bool:
        """Whether at least one of the checked renderers works."""
        return any(check.works for check in self.renderers)

    def as_json(self) -> Json:
        """Returns the report as JSON: the machine, and the checks by the renderer's name."""
        checks = {check.name: {"works": check.works, **check.facts} for check in self.renderers}
        return {**self.machine, "renderers": checks}

    def summary(self) -> str:
        """Returns several lines of text: the machine, then each renderer with its device and times, or its problem."""
        lines = [f"{key}: {value}" for key, value in self.machine.items()]
        for check in self.renderers:
            lines.append(f"{check.name}: {'works' if check.works else 'does not work'}")
            lines += [f"  {key.replace('_', ' '):12} {value}" for key, value in check.facts.items()]
        return "\n".join(lines)


def doctor(renderer: str | None = None) -> DoctorReport:
    """Checks the renderers of this machine: renders a reference frame with each of them.

    Args:
        renderer: name of the only renderer to check: raster, filament or classic; all by default.

    Raises:
        UnknownNameError: there is no renderer of that name.
    """
    machine = {
        "gear": metadata.version("mujoco-gear"),
        "python": platform.python_version(),
        "mujoco": metadata.version("mujoco"),
        "system": f"{platform.system()} {platform.machine()}",
        "cores": cores(),
    }
    names = RENDERERS if renderer is None else (renderer,)
    return DoctorReport(machine=machine, renderers=tuple(_check(name) for name in names))


def _check(name: str) -> RendererCheck:
    about = describe(name)
    try:
        result = probe(name)
    except BackendError as error:
        return RendererCheck(
            name=name, works=False, facts={"about": about, "problem": error.problem, "remedy": error.remedy}
        )
    facts = dataclasses.asdict(result.info)
    facts.pop("name")
    times = {"start_s": round(result.start_s, 3), "frame_s": round(result.frame_s, 4)}
    return RendererCheck(name=name, works=True, facts={"about": about, **facts, "sha256": result.sha256, **times})
