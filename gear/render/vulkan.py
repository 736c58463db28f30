"""Lists Vulkan devices. gear calls this before Filament, because Filament ends the process if there is no device."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

_CPU_DEVICE = 4
_SUCCESS = 0
_PROPERTIES_BYTES = 4096
"""Size of a buffer for `VkPhysicalDeviceProperties`, larger than the struct; only its first fields are read."""


class _InstanceCreateInfo(ctypes.Structure):
    _fields_ = (
        ("structure_type", ctypes.c_int32),
        ("next", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("application_info", ctypes.c_void_p),
        ("layer_count", ctypes.c_uint32),
        ("layers", ctypes.c_void_p),
        ("extension_count", ctypes.c_uint32),
        ("extensions", ctypes.c_void_p),
    )


class _PropertiesHead(ctypes.Structure):
    _fields_ = (
        ("api_version", ctypes.c_uint32),
        ("driver_version", ctypes.c_uint32),
        ("vendor_id", ctypes.c_uint32),
        ("device_id", ctypes.c_uint32),
        ("device_type", ctypes.c_int32),
        ("device_name", ctypes.c_char * 256),
    )


@dataclass(frozen=True, slots=True)
class VulkanDevice:
    """One physical Vulkan device.

    Attributes:
        name: name that the driver reports.
        is_software: whether the device is a CPU.
    """

    name: str
    is_software: bool


class VulkanUnavailableError(Exception):
    """The Vulkan loader, a driver or a device is missing; the message names the missing part."""


def vulkan_devices() -> tuple[VulkanDevice, ...]:
    """The Vulkan devices of all installed drivers; at least one device.

    Raises:
        VulkanUnavailableError: there is no device.
    """
    try:
        library = ctypes.CDLL("libvulkan.so.1")
    except OSError:
        raise VulkanUnavailableError("the Vulkan loader libvulkan.so.1 is not installed") from None
    instance = ctypes.c_void_p()
    info = _InstanceCreateInfo(structure_type=1)
    if library.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance)) != _SUCCESS:
        raise VulkanUnavailableError("no Vulkan driver is installed")
    try:
        return _enumerate(library, instance)
    finally:
        library.vkDestroyInstance(instance, None)


def _enumerate(library: ctypes.CDLL, instance: ctypes.c_void_p) -> tuple[VulkanDevice, ...]:
    count = ctypes.c_uint32()
    status = library.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    if status != _SUCCESS or not count.value:
        raise VulkanUnavailableError("the installed Vulkan drivers find no device")
    handles = (ctypes.c_void_p * count.value)()
    library.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), handles)
    devices = []
    for handle in handles:
        buffer = ctypes.create_string_buffer(_PROPERTIES_BYTES)
        library.vkGetPhysicalDeviceProperties(ctypes.c_void_p(handle), buffer)
        head = _PropertiesHead.from_buffer(buffer)
        devices.append(VulkanDevice(head.device_name.decode("utf-8", "replace"), head.device_type == _CPU_DEVICE))
    return tuple(devices)
