"""The list of people: builds, faces, clothes and colours."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from authoring.people import extras, garments, hair, hats, poses
from authoring.people.figure import Person
from authoring.people.skeleton import Build
from authoring.people.texture import Face

_WALKS = (poses.STAND, poses.WALK_A, poses.WALK_B, poses.WALK_C)
_FAIR = (0.56, 0.36, 0.27)
_OLIVE = (0.42, 0.25, 0.17)
_BROWN = (0.22, 0.115, 0.07)
_DEEP = (0.085, 0.045, 0.03)
_EAST = (0.52, 0.34, 0.23)
_BLACK_HAIR = (0.012, 0.010, 0.009)
_DARK_HAIR = (0.035, 0.022, 0.015)
_BROWN_HAIR = (0.085, 0.045, 0.025)
_BLOND_HAIR = (0.33, 0.22, 0.10)
_GREY_HAIR = (0.36, 0.36, 0.35)
_DENIM = (0.045, 0.075, 0.135)
_BRIGHTS = (
    (0.45, 0.03, 0.03, 2.0),
    (0.03, 0.09, 0.30, 3.0),
    (0.62, 0.62, 0.60, 4.0),
    (0.03, 0.03, 0.035, 4.0),
    (0.05, 0.20, 0.09, 1.5),
    (0.55, 0.36, 0.05, 1.0),
    (0.22, 0.23, 0.25, 3.0),
    (0.16, 0.35, 0.52, 2.0),
)
_SOBER = (
    (0.022, 0.024, 0.030, 4.0),
    (0.016, 0.026, 0.060, 4.0),
    (0.10, 0.10, 0.105, 3.0),
    (0.12, 0.085, 0.055, 1.0),
    (0.26, 0.25, 0.23, 1.0),
)
_COATS = (
    (0.30, 0.19, 0.10, 3.0),
    (0.020, 0.020, 0.022, 3.0),
    (0.22, 0.02, 0.03, 1.0),
    (0.12, 0.12, 0.13, 2.0),
    (0.38, 0.34, 0.28, 2.0),
    (0.02, 0.05, 0.11, 2.0),
)
_DRESSES = (
    (0.50, 0.04, 0.05, 2.0),
    (0.04, 0.16, 0.36, 2.0),
    (0.60, 0.45, 0.10, 1.0),
    (0.04, 0.04, 0.045, 2.0),
    (0.55, 0.55, 0.55, 1.0),
    (0.06, 0.25, 0.16, 1.0),
)
_WOMAN = Build(height_m=1.68, shoulders=0.9, chest=0.93, waist=0.86, hips=1.02, limbs=0.87, bust_m=0.022, female=True)

PEOPLE: tuple[Person, ...] = (
    Person(
        name="man_suit",
        build=Build(height_m=1.81, shoulders=1.04),
        face=Face(skin=_FAIR, hair=_DARK_HAIR, beard=0.35, iris=(0.06, 0.09, 0.12)),
        wear=(
            hair.short_hair,
            partial(garments.jacket, tie=True),
            partial(garments.trousers, tint="paint_dark", ease=(0.016, 0.022, 0.036)),
            partial(extras.shoes, sole_m=0.012),
            extras.briefcase,
        ),
        palette=_SOBER,
        colours={"paint_dark": (0.022, 0.024, 0.030), "tie": (0.20, 0.015, 0.02), "bag": (0.06, 0.035, 0.02)},
        poses=_WALKS,
    ),
    Person(
        name="man_casual",
        build=Build(height_m=1.78, chest=1.03, belly_m=0.012),
        face=Face(skin=_OLIVE, hair=_BLACK_HAIR, beard=0.7),
        wear=(
            hair.short_hair,
            garments.t_shirt,
            garments.trousers,
            extras.shoes,
        ),
        palette=_BRIGHTS,
        colours={"trousers": _DENIM, "shoe": (0.5, 0.5, 0.48), "sole": (0.6, 0.6, 0.58)},
        poses=(*_WALKS, poses.PHONE, poses.TALK),
        bare=("arms",),
    ),
    Person(
        name="man_hoodie",
        build=Build(height_m=1.76, shoulders=0.98, limbs=0.96),
        face=Face(skin=_DEEP, hair=_BLACK_HAIR, beard=0.3, age=0.1),
        wear=(
            hats.beanie,
            garments.hoodie,
            partial(garments.trousers, ease=(0.020, 0.030, 0.036)),
            extras.shoes,
            extras.backpack,
        ),
        palette=_BRIGHTS,
        colours={
            "trousers": (0.06, 0.06, 0.065),
            "hat": (0.10, 0.10, 0.11),
            "bag": (0.05, 0.07, 0.06),
            "bag_dark": (0.02, 0.02, 0.02),
            "shoe": (0.42, 0.06, 0.05),
            "sole": (0.6, 0.6, 0.58),
        },
        poses=(*_WALKS, poses.PHONE),
    ),
    Person(
        name="man_shorts",
        build=Build(height_m=1.74, belly_m=0.035, waist=1.12, chest=1.06, hips=1.05, limbs=1.05),
        face=Face(skin=_FAIR, hair=_BROWN_HAIR, beard=0.5, iris=(0.07, 0.11, 0.10)),
        wear=(hats.baseball_cap, garments.t_shirt, garments.shorts, extras.shoes),
        palette=_BRIGHTS,
        colours={
            "trousers": (0.33, 0.27, 0.18),
            "hat": (0.03, 0.06, 0.16),
            "shoe": (0.10, 0.10, 0.11),
            "sole": (0.6, 0.6, 0.58),
        },
        poses=_WALKS,
        bare=("arms", "legs"),
    ),
    Person(
        name="man_elderly",
        build=Build(height_m=1.70, waist=1.12, chest=1.0, limbs=0.95, belly_m=0.03, stoop_deg=9.0),
        face=Face(skin=_FAIR, hair=_GREY_HAIR, beard=0.25, age=1.0),
        wear=(
            hair.thinning,
            partial(garments.jacket, inner="shirt"),
            partial(garments.trousers, ease=(0.022, 0.030, 0.040)),
            extras.shoes,
        ),
        palette=((0.26, 0.20, 0.13, 3.0), (0.10, 0.11, 0.13, 3.0), (0.09, 0.11, 0.07, 2.0), (0.30, 0.29, 0.27, 1.0)),
        colours={"trousers": (0.14, 0.12, 0.095), "shirt": (0.36, 0.42, 0.5), "shoe": (0.07, 0.035, 0.02)},
        poses=(poses.STAND, poses.OLD_WALK_A, poses.OLD_WALK_B),
    ),
    Person(
        name="man_hat",
        build=Build(height_m=1.79, waist=1.05),
        face=Face(skin=_BROWN, hair=_BLACK_HAIR, beard=0.8, age=0.5),
        wear=(
            hats.brimmed_hat,
            partial(garments.jacket, long_m=0.44, inner="shirt"),
            partial(garments.trousers, ease=(0.016, 0.022, 0.034)),
            extras.shoes,
        ),
        palette=_COATS,
        colours={
            "trousers": (0.035, 0.036, 0.04),
            "shirt": (0.5, 0.5, 0.48),
            "hat": (0.045, 0.04, 0.035),
            "hat_band": (0.01, 0.01, 0.01),
        },
        poses=_WALKS,
    ),
    Person(
        name="man_worker",
        build=Build(height_m=1.77, shoulders=1.06, chest=1.05, limbs=1.05),
        face=Face(skin=_OLIVE, hair=_DARK_HAIR, beard=0.6, age=0.5),
        wear=(
            hair.crop,
            garments.work_jacket,
            partial(garments.trousers, ease=(0.024, 0.034, 0.044)),
            partial(extras.shoes, high=0.06),
        ),
        palette=((0.75, 0.16, 0.01, 3.0), (0.55, 0.65, 0.03, 3.0)),
        colours={"trousers": (0.025, 0.04, 0.075), "band": (0.55, 0.56, 0.57), "shoe": (0.16, 0.085, 0.04)},
        poses=(*_WALKS, poses.CALL),
    ),
    Person(
        name="woman_dress",
        build=_WOMAN,
        face=Face(skin=_FAIR, hair=_BLOND_HAIR, lips=0.7, iris=(0.08, 0.13, 0.20), age=0.15),
        wear=(hair.long_hair, garments.dress, extras.shoes, extras.shoulder_bag),
        palette=_DRESSES,
        colours={"bag": (0.16, 0.07, 0.03), "shoe": (0.10, 0.05, 0.03)},
        poses=(*_WALKS, poses.TALK),
        bare=("arms", "legs"),
    ),
    Person(
        name="woman_coat",
        build=replace(_WOMAN, height_m=1.70),
        face=Face(skin=_EAST, hair=_BLACK_HAIR, lips=0.6, age=0.1),
        wear=(
            hair.bob,
            partial(garments.jacket, long_m=0.50, inner="scarf"),
            partial(garments.trousers, ease=(0.006, 0.008, 0.010)),
            partial(extras.shoes, high=0.12),
        ),
        palette=_COATS,
        colours={"trousers": (0.02, 0.02, 0.024), "scarf": (0.45, 0.10, 0.08), "shoe": (0.03, 0.02, 0.016)},
        poses=(*_WALKS, poses.PHONE),
    ),
    Person(
        name="woman_office",
        build=replace(_WOMAN, height_m=1.66, waist=0.9, hips=1.06),
        face=Face(skin=_BROWN, hair=_BLACK_HAIR, lips=0.8, age=0.3),
        wear=(
            hair.bun,
            garments.jacket,
            partial(garments.skirt, hem_m=0.42, flare=-0.012),
            extras.shoes,
            extras.shoulder_bag,
        ),
        palette=_SOBER,
        colours={"skirt": (0.02, 0.02, 0.026), "bag": (0.03, 0.02, 0.02), "shoe": (0.02, 0.02, 0.02)},
        poses=(*_WALKS, poses.CALL),
        bare=("legs",),
    ),
    Person(
        name="woman_jeans",
        build=replace(_WOMAN, height_m=1.72, waist=0.88),
        face=Face(skin=_OLIVE, hair=_BROWN_HAIR, lips=0.5, age=0.1),
        wear=(
            hair.ponytail,
            partial(garments.t_shirt, loose=0.010),
            partial(garments.trousers, ease=(0.006, 0.009, 0.014)),
            extras.shoes,
        ),
        palette=_BRIGHTS,
        colours={"trousers": (0.09, 0.14, 0.23), "shoe": (0.55, 0.55, 0.53), "sole": (0.6, 0.6, 0.58)},
        poses=(*_WALKS, poses.PHONE),
        bare=("arms",),
    ),
    Person(
        name="woman_student",
        build=replace(_WOMAN, height_m=1.65, hips=1.08, limbs=0.92),
        face=Face(skin=_DEEP, hair=_BLACK_HAIR, lips=0.5, age=0.0),
        wear=(
            hair.curls,
            garments.hoodie,
            partial(garments.trousers, ease=(0.005, 0.007, 0.010)),
            extras.shoes,
            extras.backpack,
        ),
        palette=_BRIGHTS,
        colours={
            "trousers": (0.018, 0.018, 0.02),
            "bag": (0.40, 0.22, 0.04),
            "bag_dark": (0.05, 0.04, 0.03),
            "shoe": (0.5, 0.5, 0.48),
            "sole": (0.6, 0.6, 0.58),
        },
        poses=(*_WALKS, poses.TALK),
    ),
    Person(
        name="woman_elderly",
        build=replace(_WOMAN, height_m=1.58, waist=1.08, chest=1.02, hips=1.12, limbs=0.95, stoop_deg=10.0),
        face=Face(skin=_FAIR, hair=(0.5, 0.49, 0.47), lips=0.4, age=1.0, iris=(0.08, 0.12, 0.16)),
        wear=(
            hair.curls,
            partial(garments.shirt, tint="paint"),
            partial(garments.skirt, hem_m=0.58, flare=0.03),
            extras.shoes,
            extras.shoulder_bag,
        ),
        palette=((0.30, 0.10, 0.16, 2.0), (0.12, 0.16, 0.28, 2.0), (0.34, 0.30, 0.24, 2.0), (0.08, 0.16, 0.12, 1.0)),
        colours={"skirt": (0.09, 0.085, 0.10), "bag": (0.05, 0.02, 0.015), "shoe": (0.05, 0.035, 0.03)},
        poses=(poses.STAND, poses.OLD_WALK_A, poses.OLD_WALK_B),
        bare=("legs",),
    ),
    Person(
        name="boy",
        build=Build(height_m=1.28, head=0.91, shoulders=0.95, chest=0.97, limbs=0.92, leg=0.95),
        face=Face(skin=_FAIR, hair=_BROWN_HAIR, age=0.0),
        wear=(hair.short_hair, garments.t_shirt, garments.shorts, extras.shoes, extras.backpack),
        palette=_BRIGHTS,
        colours={
            "trousers": (0.05, 0.07, 0.13),
            "bag": (0.50, 0.12, 0.03),
            "bag_dark": (0.04, 0.04, 0.05),
            "shoe": (0.12, 0.2, 0.45),
            "sole": (0.6, 0.6, 0.58),
        },
        poses=_WALKS,
        bare=("arms", "legs"),
    ),
    Person(
        name="girl",
        build=Build(
            height_m=1.15, head=0.89, shoulders=0.90, chest=0.95, waist=0.97, limbs=0.88, leg=0.93, female=True
        ),
        face=Face(skin=_EAST, hair=_DARK_HAIR, lips=0.4, age=0.0),
        wear=(hair.ponytail, partial(garments.dress, hem_m=0.44, flare=0.05), extras.shoes),
        palette=_DRESSES,
        colours={"shoe": (0.45, 0.08, 0.12)},
        poses=_WALKS,
        bare=("arms", "legs"),
    ),
)
