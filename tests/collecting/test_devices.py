"""Plans with one device and with mixed devices, and which workers they accept."""

from __future__ import annotations

import dataclasses
import re

import pytest

from gear.collecting.devices import (
    device_of,
    has_mixed_devices,
    planned_renderer,
    planned_versions,
    refuse_other_renderer,
)
from gear.contracts.rendering import RendererInfo
from gear.values.errors import BackendError
from gear.values.serial import Json

CPU = RendererInfo(name="raster", backend="egl", driver="4.5 Mesa", device="llvmpipe", is_software=True)
GPU = RendererInfo(name="raster", backend="egl", driver="550.1", device="H200", is_software=False)
X86, ARM = ({"gear": "1", "machine": machine} for machine in ("x86_64", "aarch64"))


def content(*, mixed: bool) -> Json:
    return {"renderer": planned_renderer(CPU, mixed=mixed), "versions": planned_versions(X86, mixed=mixed)}


def test_plans_of_different_machines_are_equal_only_with_mixed_devices() -> None:
    assert planned_renderer(CPU, mixed=True) == planned_renderer(GPU, mixed=True) != planned_renderer(CPU, mixed=False)
    assert planned_versions(X86, mixed=True) == planned_versions(ARM, mixed=True) != planned_versions(X86, mixed=False)
    assert planned_renderer(GPU, mixed=False)["device"] == "H200"
    assert has_mixed_devices(content(mixed=True)) and not has_mixed_devices(content(mixed=False))
    assert not has_mixed_devices({}) and not has_mixed_devices(None)


def test_each_worker_of_mixed_devices_is_named() -> None:
    refuse_other_renderer(content(mixed=True), GPU, ARM)
    assert device_of(content(mixed=True), GPU, ARM) == {
        "backend": "egl", "driver": "550.1", "device": "H200", "machine": "aarch64"
    }  # fmt: skip
    refuse_other_renderer(content(mixed=False), CPU, X86)
    assert device_of(content(mixed=False), CPU, X86) == {}


@pytest.mark.parametrize(("info", "versions"), [(GPU, X86), (CPU, ARM)])
def test_another_device_is_refused_with_advice_on_mixed_devices(info: RendererInfo, versions: dict[str, str]) -> None:
    with pytest.raises(BackendError, match=re.escape("or with --set mixed_devices=true")):
        refuse_other_renderer(content(mixed=False), info, versions)


@pytest.mark.parametrize("mixed", [False, True])
def test_another_version_is_refused_without_that_advice(mixed: bool) -> None:
    with pytest.raises(BackendError, match=r"same renderer, device and versions$"):
        refuse_other_renderer(content(mixed=mixed), CPU, {**X86, "gear": "2"})
    with pytest.raises(BackendError, match=r"renderer\.name"):
        refuse_other_renderer(content(mixed=True), dataclasses.replace(CPU, name="classic"), X86)
