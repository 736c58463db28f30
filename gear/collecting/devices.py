"""Which graphics devices may make the samples of a split: one device, or on request any.

Two devices or drivers round colours differently, so their pictures differ in last bits. A plan therefore names one
device, and other machines are refused. With `mixed_devices: true` the plan names the renderer and the versions of the
packages only, and the sidecar of each sample names the device that rendered it.
"""

from __future__ import annotations

from gear.contracts.rendering import RendererInfo
from gear.dataset.plan import differences
from gear.formats.dataset_card import MIXED_DEVICES
from gear.values.errors import BackendError
from gear.values.serial import Json, to_json

MIXED = MIXED_DEVICES
"""Value of a plan's entries that differ between the machines of a split with mixed devices."""


def planned_renderer(info: RendererInfo, *, mixed: bool) -> Json:
    """The renderer as the plan names it.

    Args:
        info: renderer, device and driver of this machine.
        mixed: whether any device may make samples; everything but the renderer's name is then `mixed`.
    """
    content: Json = to_json(info)
    return {key: value if key == "name" else MIXED for key, value in content.items()} if mixed else content


def planned_versions(versions: dict[str, str], *, mixed: bool) -> dict[str, str]:
    """The versions of packages as the plan names them.

    Args:
        versions: versions of this machine, with the processor architecture as `machine`.
        mixed: whether any device may make samples; the processor architecture is then `mixed`.
    """
    return {**versions, "machine": MIXED} if mixed else versions


def has_mixed_devices(content: Json) -> bool:
    """Whether any device may make samples of a split.

    Args:
        content: the entries of the split's plan.
    """
    renderer = content.get("renderer") if isinstance(content, dict) else None
    return isinstance(renderer, dict) and renderer.get("device") == MIXED


def refuse_other_renderer(content: Json, info: RendererInfo, versions: dict[str, str]) -> None:
    """Refuses a machine that would make other bytes than the plan says: another device, driver or version.

    With mixed devices, only another renderer or another version of a package is refused.

    Args:
        content: the entries of the split's plan.
        info: renderer, device and driver of this worker.
        versions: versions of this worker.

    Raises:
        BackendError: names the first differences.
    """
    mixed = has_mixed_devices(content)
    planned = {key: content[key] for key in ("renderer", "versions")}
    here = {"renderer": planned_renderer(info, mixed=mixed), "versions": planned_versions(versions, mixed=mixed)}
    if differing := differences(planned, here, places=("in the plan", "on this worker")):
        problem = f"this worker would make other pictures ({', '.join(differing[:2])})"
        remedy = "collect on machines with the same renderer, device and versions"
        if all(text.startswith(("renderer.", "versions.machine")) for text in differing):
            remedy += ", or with --set mixed_devices=true, which gives up equal bytes"
        raise BackendError(info.name, problem, remedy)


def device_of(content: Json, info: RendererInfo, versions: dict[str, str]) -> dict[str, str]:
    """The device that a sample's sidecar names: `backend`, `driver`, `device` and `machine` (processor architecture).

    Args:
        content: the entries of the split's plan.
        info: renderer, device and driver of this worker.
        versions: versions of this worker.

    Returns:
        The names; empty if one device makes the whole split, which the plan names.
    """
    if not has_mixed_devices(content):
        return {}
    return {
        "backend": info.backend,
        "driver": info.driver,
        "device": info.device,
        "machine": versions["machine"],
    }
