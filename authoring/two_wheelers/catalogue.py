"""The list of two-wheelers with their riders and colours."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from authoring.people import extras, garments, hair
from authoring.people.figure import Person
from authoring.people.skeleton import Build
from authoring.people.texture import Face
from authoring.two_wheelers import bicycles, motorcycles, rider
from authoring.two_wheelers.machine import TwoWheeler

_SLIM = (0.010, 0.012, 0.018)
_MAN = Build(height_m=1.77)
_WOMAN = Build(height_m=1.69, shoulders=0.9, chest=0.93, waist=0.88, hips=1.02, limbs=0.88, bust_m=0.018, female=True)
_FAIR, _OLIVE, _BROWN = (0.56, 0.36, 0.27), (0.42, 0.25, 0.17), (0.22, 0.115, 0.07)
_DARK_HAIR, _BLOND_HAIR = (0.03, 0.02, 0.014), (0.33, 0.22, 0.10)
_SHIRTS = (
    (0.55, 0.55, 0.54, 3.0),
    (0.03, 0.09, 0.30, 3.0),
    (0.45, 0.03, 0.03, 2.0),
    (0.03, 0.03, 0.035, 3.0),
    (0.55, 0.60, 0.04, 1.0),
    (0.05, 0.20, 0.09, 1.0),
)
_TANKS = (
    (0.45, 0.015, 0.012, 3.0),
    (0.02, 0.02, 0.022, 4.0),
    (0.02, 0.07, 0.30, 2.0),
    (0.62, 0.62, 0.61, 2.0),
    (0.55, 0.20, 0.01, 1.0),
)
_VESPAS = (
    (0.62, 0.61, 0.58, 3.0),
    (0.42, 0.02, 0.018, 2.0),
    (0.10, 0.26, 0.28, 2.0),
    (0.025, 0.025, 0.027, 2.0),
    (0.48, 0.34, 0.08, 1.0),
)
_PERSON = Person(
    name="rider", build=_MAN, face=Face(skin=_FAIR, hair=_DARK_HAIR), wear=(), palette=(), colours={}, poses=()
)


def _biker() -> Person:
    wear = (
        rider.full_helmet,
        rider.riding_jacket,
        partial(garments.trousers, ease=_SLIM),
        partial(extras.shoes, high=0.12),
    )
    colours = {"trousers": (0.03, 0.035, 0.05), "helmet": (0.03, 0.03, 0.032), "visor": (0.012, 0.014, 0.018)}
    return replace(_PERSON, wear=wear, colours=colours, face=Face(skin=_OLIVE, hair=_DARK_HAIR, beard=0.3))


def _courier() -> Person:
    wear = (
        hair.crop,
        rider.open_helmet,
        rider.riding_jacket,
        partial(garments.trousers, ease=(0.012, 0.018, 0.026)),
        extras.shoes,
    )
    colours = {"trousers": (0.05, 0.08, 0.14), "helmet": (0.55, 0.55, 0.54), "sole": (0.5, 0.5, 0.48)}
    return replace(_PERSON, wear=wear, colours=colours, face=Face(skin=_BROWN, hair=_DARK_HAIR, beard=0.5))


def _cyclist() -> Person:
    wear = (hair.crop, rider.cycle_helmet, rider.riding_jacket, partial(garments.trousers, ease=_SLIM), extras.shoes)
    colours = {"trousers": (0.025, 0.025, 0.03), "helmet": (0.50, 0.50, 0.50), "shoe": (0.3, 0.3, 0.3)}
    return replace(_PERSON, wear=wear, colours=colours)


def _city_rider() -> Person:
    wear = (hair.long_hair, rider.riding_jacket, partial(garments.trousers, ease=_SLIM), extras.shoes)
    colours = {"trousers": (0.08, 0.12, 0.20), "shoe": (0.5, 0.5, 0.48)}
    return replace(_PERSON, build=_WOMAN, wear=wear, colours=colours, face=Face(skin=_FAIR, hair=_BLOND_HAIR, lips=0.6))


def _pedals(crank_deg: float) -> dict[str, tuple[float, float, float]]:
    feet = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        x, y, z = bicycles.pedal(sign, crank_deg)
        feet[side] = (x, y, z + 0.012)
    return feet


def two_wheelers() -> tuple[TwoWheeler, ...]:
    """Returns all two-wheelers."""
    return (
        TwoWheeler(
            name="motorcycle_a",
            kind="motorcycle",
            hard=motorcycles.standard_hard(),
            soft=motorcycles.standard_soft(),
            rider=_biker(),
            seat=rider.Seat(
                hips=(-0.24, 0.0, 0.925),
                grip=(0.262, 0.345, 1.079),
                foot={"left": (-0.10, 0.225, 0.360), "right": (-0.10, -0.225, 0.360)},
                lean_deg=16.0,
                pelvis_deg=4.0,
                sole_deg=-12.0,
                knees_out=0.35,
                head_pitch_deg=4.0,
            ),
            palette=_TANKS,
            painted="machine",
            colour=(0.032, 0.032, 0.036),
        ),
        TwoWheeler(
            name="motorcycle_b",
            kind="motorcycle",
            hard=motorcycles.scooter_hard(),
            soft=motorcycles.scooter_soft(),
            rider=_courier(),
            seat=rider.Seat(
                hips=(-0.38, 0.0, 0.895),
                grip=(0.338, 0.30, 1.059),
                foot={"left": (0.30, 0.13, 0.307), "right": (0.30, -0.13, 0.307)},
                lean_deg=6.0,
                knees_out=0.15,
            ),
            palette=_VESPAS,
            painted="machine",
            colour=(0.10, 0.20, 0.11),
        ),
        TwoWheeler(
            name="bicycle_a",
            kind="bicycle",
            hard=bicycles.trekking(35.0),
            rider=_cyclist(),
            seat=rider.Seat(
                hips=(-0.315, 0.0, 1.045),
                grip=(0.36, 0.255, 0.989),
                foot=_pedals(35.0),
                lean_deg=32.0,
                pelvis_deg=14.0,
                sole_deg=-6.0,
                knees_out=0.04,
                head_pitch_deg=8.0,
            ),
            palette=_SHIRTS,
            painted="rider",
            colour=(0.02, 0.05, 0.12),
        ),
        TwoWheeler(
            name="bicycle_b",
            kind="bicycle",
            hard=bicycles.city(250.0),
            rider=_city_rider(),
            seat=rider.Seat(
                hips=(-0.305, 0.0, 0.975),
                grip=(0.178, 0.293, 1.066),
                foot=_pedals(250.0),
                lean_deg=8.0,
                pelvis_deg=4.0,
                sole_deg=-4.0,
                knees_out=0.06,
                head_pitch_deg=2.0,
            ),
            palette=_SHIRTS,
            painted="rider",
            colour=(0.12, 0.26, 0.24),
        ),
    )
