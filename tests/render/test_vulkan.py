"""The list of Vulkan devices."""

from __future__ import annotations

import ctypes
from typing import Any

import pytest

from gear.render import vulkan
from gear.render.vulkan import VulkanUnavailableError, vulkan_devices

SUCCESS, CPU, DISCRETE = 0, 4, 2


class Library:
    """A Vulkan loader with some devices."""

    def __init__(self, *devices: tuple[str, int], status: int = SUCCESS) -> None:
        self.devices, self.status, self.destroyed = devices, status, 0

    def vkCreateInstance(self, info: Any, allocator: Any, instance: Any) -> int:  # noqa: N802  Vulkan's name
        return self.status

    def vkDestroyInstance(self, instance: Any, allocator: Any) -> None:  # noqa: N802
        self.destroyed += 1

    def vkEnumeratePhysicalDevices(self, instance: Any, count: Any, handles: Any) -> int:  # noqa: N802
        if handles is None:
            count._obj.value = len(self.devices)
        else:
            for place in range(len(self.devices)):
                handles[place] = place + 1
        return SUCCESS

    def vkGetPhysicalDeviceProperties(self, handle: Any, buffer: Any) -> None:  # noqa: N802
        name, kind = self.devices[handle.value - 1]
        head = vulkan._PropertiesHead.from_buffer(buffer)
        head.device_type, head.device_name = kind, name.encode()


def test_devices_have_their_names_and_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    library = Library(("llvmpipe", CPU), ("H200", DISCRETE))
    monkeypatch.setattr(ctypes, "CDLL", lambda name: library)
    assert [(one.name, one.is_software) for one in vulkan_devices()] == [("llvmpipe", True), ("H200", False)]
    assert library.destroyed == 1


@pytest.mark.parametrize(
    ("library", "message"),
    [
        (None, "the Vulkan loader libvulkan.so.1 is not installed"),
        (Library(status=-9), "no Vulkan driver is installed"),
        (Library(), "the installed Vulkan drivers find no device"),
    ],
)
def test_what_is_missing_is_named(library: Library | None, message: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def load(name: str) -> Library:
        if library is None:
            raise OSError(name)
        return library

    monkeypatch.setattr(ctypes, "CDLL", load)
    with pytest.raises(VulkanUnavailableError, match=message):
        vulkan_devices()
