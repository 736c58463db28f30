"""Number plates: the text of each vehicle, and the drawing of a plate. No authority issues this series."""

from __future__ import annotations

from PIL import Image, ImageDraw

from authoring.vehicles.lettering import lettering

__all__ = ["PLATES", "SHARED_PLATES", "draw_plate"]

PLATES = {
    "bus_city": "GR 20 KV",
    "car_city": "HA 63 NE",
    "car_estate": "TO 18 WD",
    "car_hatchback": "GR 47 AE",
    "car_pickup": "LF 95 MK",
    "car_police": "PV 30 XA",
    "car_saloon": "KE 72 RU",
    "car_sports": "SZ 81 FT",
    "car_suv": "GR 56 HY",
    "car_taxi": "TX 34 BO",
    "truck_box": "LO 69 PC",
    "truck_rigid": "DU 41 VG",
    "van_ambulance": "RA 12 EK",
    "van_panel": "NW 87 JL",
}
"""Texts by the name of the vehicle's file; front and rear plate are equal. Motorcycles have texts of their own."""

SHARED_PLATES = (
    "GR 68 LP", "KE 15 BD", "TO 92 VA", "HA 27 SC", "LO 44 EX", "GR 39 MU", "NW 51 TF", "DU 73 RK", "KE 86 OL",
    "SZ 20 HW", "TO 57 NY", "PV 64 GB", "LF 31 CE", "GR 90 DA", "HA 78 UR", "RA 45 JT", "LO 13 WN", "KE 29 PH",
)  # fmt: skip
"""Texts of the plates of all further instances of a vehicle in a town."""

_EDGE, _WHITE, _BLUE, _INK = (20, 20, 20), (232, 232, 226), (28, 58, 150), (16, 16, 18)


def draw_plate(text: str, width: int, height: int) -> Image.Image:
    """Draws a plate that fills a picture of `width` by `height` pixels: dark edge, blue band at the left, one line of
    text.

    A plate less than twice as wide as high, such as a motorcycle's, has two lines and no band.
    """
    plate = Image.new("RGB", (width, height), _EDGE)
    draw = ImageDraw.Draw(plate)
    thin = max(1, round(0.045 * height))
    box = (thin, thin, width - 1 - thin, height - 1 - thin)
    draw.rounded_rectangle(box, radius=2 * thin, fill=_WHITE)
    if width < 2 * height:
        first, _, second = text.partition(" ")
        lines = [(first, 0.28, 0.72, 0.12, 0.46), (second, 0.14, 0.86, 0.54, 0.88)]
    else:
        draw.rounded_rectangle((thin, thin, round(0.075 * width), height - 1 - thin), radius=2 * thin, fill=_BLUE)
        lines = [(text, 0.11, 0.965, 0.19, 0.81)]
    for words, left, right, top, bottom in lines:
        mask = lettering(words, round((right - left) * width), round((bottom - top) * height))
        plate.paste(_INK, (round(left * width), round(top * height)), mask)
    return plate
