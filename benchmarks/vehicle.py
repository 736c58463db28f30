"""How fast the physics of the ego car are: `python benchmarks/vehicle.py [TOWN SCENE]`.

Drives the four-wheeled car of `dynamics: mujoco` through a town, along lanes and with commands that change ten times
per second, and prints the simulated seconds per second of processor time.
"""

from __future__ import annotations

import argparse
import math
import time

from gear.collecting.lookup import look_up
from gear.config.load import load_collection
from gear.contracts.controllers import Action
from gear.driving.simulation import FRAME_S, TICKS
from gear.driving.vehicle import VehicleState
from gear.driving.wheeled_car import WheeledCar
from gear.values.geometry import RigidTransform
from gear.world.compilation.world_cache import load_or_compile

STARTS, SECONDS = 5, 8.0


def main() -> None:
    """Prints the speed of the physics."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("town", nargs="?", default="town10")
    parser.add_argument("scene", nargs="?", default="billboard01")
    args = parser.parse_args()
    town, scene = args.town, args.scene
    config = load_collection(None, {"task": "semseg", "town": town, "scene": scene}, [])
    named = look_up(config)
    world = load_or_compile(town=config.town, scene_name=config.scene, scene=named.scene, weather=named.weather)
    car = WheeledCar(world.placement_model, world.types[world.slots[0].actor.name])
    lanes = sorted(world.lanes.lanes.values(), key=lambda lane: -lane.line.length_m)[:STARTS]
    used_s = simulated_s = 0.0
    for lane in lanes:
        point, yaw_rad = lane.line.at(5.0)
        state = VehicleState(x_m=float(point[0]), y_m=float(point[1]), yaw_rad=yaw_rad, speed_mps=8.0)
        car.reset(state, RigidTransform.from_yaw("world", "actor", point, yaw_rad))
        begun_s = time.process_time()
        for frame in range(round(SECONDS / FRAME_S)):
            wave = math.sin(frame * FRAME_S)
            for _ in range(TICKS):
                car.step(Action(acceleration_mps2=2.0 * wave, steering_rad=0.02 * wave), FRAME_S / TICKS)
        used_s += time.process_time() - begun_s
        simulated_s += SECONDS
    print(f"{town}: {car.model.ngeom} geoms, {simulated_s:.0f} s simulated in {used_s:.1f} s of processor time:"
          f" {simulated_s / used_s:.1f} x real time")  # fmt: skip


if __name__ == "__main__":
    main()
