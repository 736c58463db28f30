"""Gymnasium environments of the closed loop. `import gear.envs` registers `gear/Drive-v0` with Gymnasium.

They need the extra `gym`: `pip install 'mujoco-gear[gym]'`.
"""

from __future__ import annotations

from gear.values.errors import GearError

try:
    from gymnasium.envs.registration import register, registry
except ModuleNotFoundError as error:
    raise GearError("gear.envs needs Gymnasium: pip install 'mujoco-gear[gym]'") from error

DRIVE = "gear/Drive-v0"
"""Id of the environment `gear.envs.drive.DriveEnv`."""

if DRIVE not in registry:
    register(id=DRIVE, entry_point="gear.envs.drive:DriveEnv")
