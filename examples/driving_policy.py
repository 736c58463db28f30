"""Trains a small driving policy in the closed loop of gear: `python examples/driving_policy.py`.

The policy keeps to the lane and brakes for obstacles; three of its numbers are found by the cross-entropy method
(Rubinstein, 1999): how long before a collision it brakes, how far to the side an obstacle may be to count, and how far
ahead it looks when it steers. It needs no pictures and no network: `pip install 'mujoco-gear[gym]'`.
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

import gear.envs
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN

Floats = npt.NDArray[np.float64]

NAMES = ("brake_below_s", "corridor_m", "look_ahead_m")
START, SPREAD = np.array([0.5, 0.5, 12.0]), np.array([1.0, 0.5, 6.0])
LEAST, MOST = np.array([0.1, 0.2, 4.0]), np.array([4.0, 3.0, 30.0])
WHEELBASE_M, MOST_STEERING_RAD = 2.7, 0.6


def act(observation: dict[str, Any], parameters: Floats) -> npt.NDArray[np.float32]:
    """Pedals and steering, -1 to 1, from one observation."""
    brake_below_s, corridor_m, look_ahead_m = parameters
    speed_mps, _, _, cruise_mps, _, _ = observation["ego"]
    path = observation["path"]
    target = path[int(np.argmin(np.abs(np.linalg.norm(path, axis=1) - look_ahead_m)))]
    steering = np.arctan2(2 * WHEELBASE_M * target[1], float(target @ target)) / MOST_STEERING_RAD
    pedals = np.clip((cruise_mps - speed_mps) / 2, -0.3, 0.5)
    for is_there, _, ahead_m, left_m, _, half_length_m, half_width_m, ahead_mps, _ in observation["obstacles"]:
        aside_m = abs(left_m - np.interp(ahead_m, path[:, 0], path[:, 1]))
        gap_m, closing_mps = ahead_m - half_length_m - 2.3, speed_mps - ahead_mps
        if is_there and ahead_m > 0 and aside_m < half_width_m + corridor_m and gap_m < brake_below_s * closing_mps + 1:
            pedals = -1.0
    return np.array([pedals, steering], np.float32)


def drive(env: gymnasium.Env[Any, Any], parameters: Floats, scenario: str, seed: int) -> tuple[float, bool]:
    """The sum of the rewards of one episode, and whether the car crashed or left the road."""
    observation, _ = env.reset(seed=seed, options={"scenario": scenario})
    total, is_lost, is_over = 0.0, False, False
    while not (is_lost or is_over):
        observation, reward, is_lost, is_over, _ = env.step(act(observation, parameters))
        total += float(reward)
    return total, is_lost


def train(env: gymnasium.Env[Any, Any], generations: int, population: int, seed: int = 0) -> Floats:
    """The mean of the best parameters after some generations of the cross-entropy method."""
    rng = np.random.Generator(np.random.PCG64(seed))
    mean, spread = START, SPREAD
    for generation in range(generations):
        candidates = np.clip(mean + spread * rng.standard_normal((population, len(NAMES))), LEAST, MOST)
        scores = [
            sum(drive(env, one, scenario, generation)[0] for scenario in ("stopped_lead", "free_road"))
            for one in candidates
        ]
        best = candidates[np.argsort(scores)[-max(2, population // 3) :]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.05
        print(f"generation {generation}: best {max(scores):.1f}, mean {np.mean(scores):.1f}")
    return mean


def main(arguments: list[str] | None = None) -> int:
    """Trains a policy, drives scenarios of seeds that it has not seen, and prints how many it survives."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=3)
    parser.add_argument("--population", type=int, default=6)
    parser.add_argument("--tests", type=int, default=3, help="drives of each scenario after training")
    asked = parser.parse_args(arguments)
    env = gymnasium.make(gear.envs.DRIVE, town=str(TINY_TOWN), scenes=str(TINY_SCENES), scene="board", speed_kmh=30)
    for name, parameters in (("before", START), ("after", train(env, asked.generations, asked.population))):
        numbers = ", ".join(f"{key} {value:.2f}" for key, value in zip(NAMES, parameters, strict=True))
        drives = [
            drive(env, parameters, scenario, 100 + seed)
            for scenario in ("stopped_lead", "free_road")
            for seed in range(asked.tests)
        ]
        lost = sum(is_lost for _, is_lost in drives)
        print(f"{name} training ({numbers}): {lost} of {len(drives)} drives lost")
    env.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
