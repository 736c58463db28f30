"""The radiance of the sky by direction: the analytic daylight of Preetham, Shirley and Smits (1999), with clouds.

Directions are unit vectors in world axes (x east, y north, z up). Radiance is in kcd/m² for each linear sRGB channel,
so that it can be compared with the light of a sun in klx on a white surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
import numpy.typing as npt

from gear.camera.fractal import TILE_PX, periodic_noise, sampled
from gear.values.geometry import frozen
from gear.values.rng import derive_rng
from gear.values.scene import Weather

Floats = npt.NDArray[np.float64]

_MIN_ALTITUDE_RAD = math.radians(1.5)
"""Lowest altitude of the sun, in radians, for which the formulas of the sky are used. A lower sun gives the sky of a
sun at this altitude, but darker.
"""

_NIGHT_TINT = np.array([0.72, 0.84, 1.0])
_NIGHT_CLOUDS = np.array([1.25, 1.12, 1.0])
_GROUND_ALBEDO = np.array([0.16, 0.15, 0.13])
_SUN_KLX = 128.0 * np.array([1.03, 1.0, 0.96])
_WAVELENGTHS_UM = np.array([0.610, 0.550, 0.465])
_RGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_D65 = (0.3127, 0.3290)
_SATURATION = 0.7
"""Factor on the model's saturation. With 1, the light of a clear sky on a level surface would have 2.5 times as
much blue as red, more than skylight of 10 000 to 12 000 K.
"""

_HORIZON_BLUR = 0.035
_DISC_COSINE = math.cos(math.radians(0.5))
_DISC_SR = 2 * math.pi * (1 - _DISC_COSINE)
_AT_A_TIME = 1 << 14

# Distribution coefficients (A to E, each slope and offset in turbidity) of luminance and chromaticities, from the
# paper.
_PEREZ = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
}
_ZENITH_X = (
    (0.00166, -0.00375, 0.00209, 0.0),
    (-0.02903, 0.06377, -0.03202, 0.00394),
    (0.11693, -0.21196, 0.06052, 0.25886),
)
_ZENITH_Y = (
    (0.00275, -0.00610, 0.00317, 0.0),
    (-0.04214, 0.08970, -0.04153, 0.00516),
    (0.15346, -0.26756, 0.06670, 0.26688),
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sky:
    """Sun and sky of one weather.

    Attributes:
        towards_sun: (3,) unit vector towards the sun, world axes.
        sun_klx: (3,) illuminance in klx, for each linear sRGB channel, of a surface that faces the sun, below the
            clouds.
        cloud_cover: share of the sky that clouds cover, 0..1.
        turbidity: haziness of the clear air; 2 is very clear.
        blueness: how saturated the clear sky is; 1 for clear air.
        night: 0 while the sun is up, 1 when its light has left the sky.
    """

    towards_sun: Floats
    sun_klx: Floats
    cloud_cover: float
    turbidity: float
    blueness: float
    night: float

    @staticmethod
    @lru_cache(maxsize=8)
    def of(weather: Weather) -> Sky:
        """Makes the sky for a weather, which has CARLA's parameters; the same object for equal weathers.

        Args:
            weather: the weather.
        """
        altitude = math.radians(weather.sun_altitude_deg)
        azimuth = math.radians(weather.sun_azimuth_deg)
        shown_altitude = max(altitude, _MIN_ALTITUDE_RAD)
        towards_sun = np.array(
            [
                math.cos(azimuth) * math.cos(shown_altitude),
                math.sin(azimuth) * math.cos(shown_altitude),
                math.sin(shown_altitude),
            ]
        )
        cover = weather.cloud_cover
        turbidity = float(np.clip(2.5 + 40 * (weather.mie_scattering_scale - 0.03), 2.0, 9.0))
        # Twilight: the light of the sun vanishes within a few degrees.
        daylight = float(_smooth_step(math.radians(-8), math.radians(3), np.array(altitude)))
        through_clouds = 1 - 0.97 * float(_smooth_step(0.15, 0.95, np.array(cover)))
        return Sky(
            towards_sun=frozen(towards_sun),
            sun_klx=frozen(_beam_klx(shown_altitude, turbidity) * through_clouds * max(daylight, 0.01)),
            cloud_cover=cover,
            turbidity=turbidity,
            blueness=float(np.clip(weather.rayleigh_scattering_scale / 0.0331, 0.0, 1.5)),
            night=weather.night,
        )

    def radiance(self, directions: Floats, *, with_disc: bool = True) -> Floats:
        """The radiance by direction: sky and clouds above the horizon, sunlit ground below the horizon.

        Args:
            directions: (..., 3) unit vectors, world axes.
            with_disc: whether the disc of the sun is included, as for a picture of the sky. The disc must be left out
                when light is integrated over a few directions, because one direction that hits the small disc would
                have the weight of thirty suns.

        Returns:
            (..., 3) kcd/m² for each linear sRGB channel.
        """
        flat = directions.reshape(-1, 3)
        ground = self._ground()
        result = np.broadcast_to(ground, flat.shape).copy()
        seen = np.flatnonzero(flat[:, 2] > -_HORIZON_BLUR)
        # Blocks that stay in the processor's cache take half the time, and need no new memory at every step.
        for begin in range(0, len(seen), _AT_A_TIME):
            some = seen[begin : begin + _AT_A_TIME]
            rays = flat[some]
            share = _smooth_step(-_HORIZON_BLUR, 0.0, rays[:, 2])[:, None]
            result[some] = share * self._above(rays, with_disc=with_disc) + (1 - share) * ground
        return result.reshape(directions.shape)

    def horizon_radiance(self, azimuths: int) -> Floats:
        """Radiance of distant air around the horizon.

        The light of distant air has been scattered several times. The result is therefore the average of the radiance
        in the direction and of the mean over all directions, and the glare around the sun is limited.

        Args:
            azimuths: number of directions, evenly spaced counter-clockwise from east.

        Returns:
            (azimuths, 3) radiance in kcd/m².
        """
        angles = np.linspace(0, 2 * math.pi, azimuths, endpoint=False)
        ring = np.column_stack([np.cos(angles), np.sin(angles), np.full_like(angles, 0.04)])
        clear = self._clear(ring / np.linalg.norm(ring, axis=1, keepdims=True))
        clear = np.minimum(clear, 2.5 * np.median(clear, axis=0))
        mixed = 0.5 * clear + 0.5 * clear.mean(axis=0)
        return np.asarray((1 - self.cloud_cover) * mixed + self.cloud_cover * self._cloud_base())

    def _ground(self) -> Floats:
        zenith = self._above(np.array([[0.0, 0.0, 1.0]]), with_disc=False)[0]
        return np.asarray(_GROUND_ALBEDO * (self.sun_klx * self.towards_sun[2] / math.pi + zenith))

    def _above(self, directions: Floats, *, with_disc: bool) -> Floats:
        """(N, 3) radiance of sky and clouds in kcd/m²; also defined for directions below the horizon."""
        clear = self._clear(directions)
        towards_sun = directions @ self.towards_sun
        if with_disc:
            clear[towards_sun > _DISC_COSINE] += self.sun_klx / _DISC_SR
        noise = _cloud_noise(directions)
        clouds = self._clouds(noise, directions[:, 2], towards_sun)
        opacity = self._opacity(noise, directions[:, 2])[:, None]
        return np.asarray(clear + opacity * (clouds - clear))

    def _clear(self, directions: Floats) -> Floats:
        """(N, 3) kcd/m² of the clear sky."""
        zenith_angle = math.acos(float(np.clip(self.towards_sun[2], -1, 1)))
        cos_view = np.maximum(directions[:, 2], 0.01)
        cos_sun = np.clip(directions @ self.towards_sun, -1, 1)
        zeniths = _zenith(self.turbidity, zenith_angle)
        values = {
            name: zenith
            * _perez(name, self.turbidity, cos_view, cos_sun)
            / _perez_zenith(name, self.turbidity, zenith_angle)
            for name, zenith in zeniths.items()
        }
        luminance, x, y = values["Y"], values["x"], values["y"]
        # Under a high sun the model's horizon is too red; real horizons are whitish.
        whitish = self.towards_sun[2] * np.exp(-directions[:, 2].clip(0) / 0.12)
        tint = _SATURATION * self.blueness * (1 - 0.8 * whitish)
        x, y = _D65[0] + tint * (x - _D65[0]), _D65[1] + tint * (y - _D65[1])
        xyz = np.column_stack([luminance * x / y, luminance, luminance * (1 - x - y) / y])
        day = np.maximum(xyz @ _RGB_FROM_XYZ.T, 0.0)
        if not self.night:
            return np.asarray(day)
        # The glow around the sunset fades with the night.
        return np.asarray(day + self.night * (_NIGHT_TINT * zeniths["Y"] - day))

    def _cloud_base(self) -> Floats:
        """(3,) mean radiance of clouds in kcd/m². Clouds of an overcast sky have half the radiance of single clouds."""
        beam = _beam_klx(math.asin(self.towards_sun[2]), self.turbidity)
        global_klx = beam * self.towards_sun[2] + 0.18 * beam.mean()
        tint = 0.4 - 0.3 * self.cloud_cover
        grey = (1 - tint) * global_klx.mean() + tint * global_klx
        day = (0.72 - 0.36 * self.cloud_cover) * grey / math.pi
        if not self.night:
            return np.asarray(day)
        # A town's lamps reach clouds, but not the sky behind them.
        zenith = _zenith(self.turbidity, math.acos(float(self.towards_sun[2])))["Y"]
        return np.asarray(day + self.night * (_NIGHT_CLOUDS * zenith - day))

    def _clouds(self, noise: Floats, height: Floats, towards_sun: Floats) -> Floats:
        """(N, 3) radiance of clouds in kcd/m²: bright where they are thin and near the sun; an overcast sky
        follows the CIE's formula.
        """
        overcast = (1 + 2 * np.maximum(height, 0)) * (3 / 7)
        shade = (1.2 - 0.45 * noise) * (1 + self.cloud_cover**2 * (overcast - 1))
        glow = 0.8 * (1 - self.cloud_cover) * np.exp((towards_sun - 1) / 0.08)
        return np.asarray((shade + glow)[:, None] * self._cloud_base())

    def _opacity(self, noise: Floats, height: Floats) -> Floats:
        """(N,) opacity of the clouds, 0..1. The noise is uniformly distributed, so the share above the threshold
        equals the cloud cover.
        """
        edge = 1 - 1.15 * self.cloud_cover
        opacity = _smooth_step(edge - 0.05, edge + 0.18, noise)
        # Distant clouds fade into the haze of the horizon.
        return np.asarray(opacity * (1 - (1 - self.cloud_cover) * (1 - _smooth_step(0.02, 0.2, height))))


def _smooth_step(low: float, high: float, value: Floats) -> Floats:
    t = np.clip((value - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3 - 2 * t))


def _beam_klx(altitude_rad: float, turbidity: float) -> Floats:
    """(3,) direct normal illuminance in klx under a clear sky: Rayleigh and Ångström extinction, Kasten's air mass."""
    altitude_deg = math.degrees(altitude_rad)
    air_mass = 1 / (math.sin(altitude_rad) + 0.15 * (altitude_deg + 3.885) ** -1.253)
    rayleigh = 0.008735 * _WAVELENGTHS_UM**-4.08
    aerosol = (0.04608 * turbidity - 0.04586) * _WAVELENGTHS_UM**-1.3
    return np.asarray(_SUN_KLX * np.exp(-(rayleigh + aerosol) * air_mass))


def _zenith(turbidity: float, sun_zenith_rad: float) -> dict[str, float]:
    """Luminance `Y` in kcd/m² and chromaticities `x`, `y` at the zenith, by Preetham's appendix A.2."""
    chi = (4 / 9 - turbidity / 120) * (math.pi - 2 * sun_zenith_rad)
    powers = np.array([sun_zenith_rad**3, sun_zenith_rad**2, sun_zenith_rad, 1.0])
    rows = np.array([turbidity**2, turbidity, 1.0])
    return {
        "Y": (4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192,
        "x": float(rows @ np.array(_ZENITH_X) @ powers),
        "y": float(rows @ np.array(_ZENITH_Y) @ powers),
    }


def _perez(name: str, turbidity: float, cos_view: Floats, cos_sun: Floats) -> Floats:
    a, b, c, d, e = (slope * turbidity + offset for slope, offset in _PEREZ[name])
    angle = np.arccos(cos_sun)
    return np.asarray((1 + a * np.exp(b / cos_view)) * (1 + c * np.exp(d * angle) + e * cos_sun**2))


def _perez_zenith(name: str, turbidity: float, sun_zenith_rad: float) -> float:
    return float(_perez(name, turbidity, np.array(1.0), np.array(math.cos(sun_zenith_rad))))


_OCTAVES = (4, 8, 16, 32, 64, 128, 256)


@cache
def _cloud_tile() -> npt.NDArray[np.float32]:
    """(`TILE_PX`, `TILE_PX`) float32 fractal texture of the clouds, the same in every process."""
    return periodic_noise(derive_rng(0, "sky", "clouds"), _OCTAVES, 0.85)


def _cloud_noise(directions: Floats) -> Floats:
    """(N,) values of the clouds' texture in (N, 3) directions, on a layer that meets the horizon as on the
    curved Earth.
    """
    reach = 0.16 * TILE_PX / (np.maximum(directions[:, 2], 0.0) + 0.1)
    return sampled(_cloud_tile(), directions[:, 0] * reach, directions[:, 1] * reach).astype(np.float64)
