"""Which unit a named coordinate system has: degrees, metres, or the stretched metres of web maps.

No library of projections is needed for that: what is known here are the systems of open data whose
axes are longitude and latitude from Greenwich in degrees, or metres on the ground to the east and
north. Datums differ by a few hundred metres at most, which shifts a place but not what lies in it.
"""

import math
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

_RADIUS = 6378137.0
"""Metres; of the sphere of web maps."""

_GEOGRAPHIC = {
    *(4326, 4979, 4322, 4324, 4055, 9057, 9755),  # WGS 84, WGS 72, popular sphere
    *(4258, 4937, 4230, 4231, 4171, 4265, 4670, 6706),  # Europe: ETRS89, ED50, RGF93, Italy
    *(4277, 4314, 4312, 4313, 4289, 4275, 4300, 4299, 4188, 4149, 4150, 4151, 4156),
    *(4173, 4180, 4619, 4669, 4661, 4765, 4670, 4659, 4179, 4178, 4200, 4284, 4740, 7683, 7679),
    *(4269, 4267, 4152, 4759, 6318, 4617, 4955, 4954, 6319, 8449, 4954, 8232),  # North America
    *(4674, 4618, 4686, 4190, 4170, 4989, 4170, 5527, 4225, 4248, 5360, 5381, 4189, 5365),
    *(4283, 7844, 4939, 4167, 4272, 4959, 4202, 4203, 4720, 4749),  # Oceania
    *(4612, 6668, 4301, 4490, 4610, 4214, 4555, 4240, 4754, 4755, 4756, 4737, 4162, 4019, 4047),
    *(4148, 4222, 4209, 4261, 4262, 4210, 4558, 4559, 4627, 4742, 4141, 4240, 4239, 4611, 4236),
}
_WEB_MERCATOR = {3857, 3785, 900913, 102100, 102113, 3587}
_METRES = {
    *(3034, 3035, 2154, 27700, 28992, 7415, 31370, 3812, 2056, 21781, 3006, 3067, 3301, 3763),
    *(31466, 31467, 31468, 31469, 31254, 31255, 31256, 31257, 31258, 31259, 31287, 3416, 2180),
    *(2176, 2177, 2178, 2179, 3003, 3004, 6707, 6708, 6875, 2100, 3765, 3794, 3346, 3059, 2157),
    *(29903, 29902, 5514, 3844, 23700, 7801, 4647, 5243, 27571, 27572, 27573, 27574),
    *(2193, 3577, 3111, 3112, 7855, 5070, 5071, 3347, 3348, 3978, 3979, 2326, 3414, 5186),
    *(5179, 5174, 2039, 6991, 3005, 3310, 3338, 6350, 2048, 2049, 2050, 2046, 2047, 2051),
}
_METRE_RANGES = (
    (32601, 32660),  # WGS 84 / UTM, north
    (32701, 32760),  # and south
    (32201, 32260),
    (32301, 32360),
    (25828, 25838),  # ETRS89 / UTM
    (3040, 3051),
    (23028, 23038),  # ED50 / UTM
    (26901, 26923),  # NAD83 / UTM
    (26703, 26722),  # NAD27 / UTM
    (3154, 3160),
    (2955, 2962),
    (6328, 6348),
    (31965, 31985),  # SIRGAS / UTM
    (28348, 28358),  # GDA94 / MGA
    (7846, 7859),  # GDA2020 / MGA
    (2443, 2461),  # Japan
    (6669, 6687),
    (3873, 3885),  # ETRS89 / GK of Finland
    (3942, 3950),  # RGF93 / CC
    (4491, 4554),  # China, Gauss-Kruger
    (28402, 28432),  # Pulkovo / Gauss-Kruger
    (20004, 20032),
    (29187, 29195),
)
_DEGREE_NAMES = {
    "wgs84",
    "wgs1984",
    "gcswgs1984",
    "etrs89",
    "nad83",
    "nad27",
    "gcsetrs1989",
    "gcsnorthamerican1983",
}
_MERCATOR_NAMES = ("pseudomercator", "webmercator", "googlemercator", "mercatorauxiliarysphere")


def unit_of(crs: Any) -> tuple[str, str]:
    """Returns the unit of a GeoJSON member "crs", and the system's name for messages.

    The unit is "degrees", "metres" or "web" (`from_web_map`).

    Raises:
      ValueError: the system is not known.
    """
    name = _name_of(crs)
    found = (
        re.search(r"(\d{4,6})\D*$", name)
        if re.search(r"epsg|esri|srid|ogc:?urn|^\d+$", name, re.I)
        else None
    )
    code = int(found[1]) if found else 0
    plain = re.sub(r"[^a-z0-9]", "", name.lower())
    if (
        re.search(r"crs:?8[34]h?$|crs:?27$", name, re.I)
        or code in _GEOGRAPHIC
        or plain in _DEGREE_NAMES
    ):
        return "degrees", name
    if code in _WEB_MERCATOR or any(part in plain for part in _MERCATOR_NAMES):
        return "web", name
    if code in _METRES or any(first <= code <= last for first, last in _METRE_RANGES):
        return "metres", name
    if re.search(r"utmzone\d+[ns]?$", plain) or plain.endswith(("laeaeurope", "etrslaea")):
        return "metres", name
    raise ValueError(
        f"the coordinate system {name[:80]!r} is not known here, so that nobody knows what its"
        " units are: export the file in longitude and latitude (EPSG:4326), or say --units degrees"
        " or --units metres (units=...)"
    )


def from_web_map(points: ArrayLike) -> np.ndarray:
    """Returns coordinates of a web map (EPSG:3857), float [..., 2], as longitude and latitude."""
    x, y = np.moveaxis(np.asarray(points, np.float64), -1, 0)
    latitude = 2 * np.arctan(np.exp(np.clip(y / _RADIUS, -50, 50))) - math.pi / 2
    return np.degrees(np.stack([x / _RADIUS, latitude], axis=-1))


def _name_of(crs: Any) -> str:
    """Returns the name in any of the forms that programs write: a text, a name, a code, a
    projjson id.
    """
    if isinstance(crs, str):
        return crs.strip()
    if isinstance(crs, int) and not isinstance(crs, bool):
        return f"EPSG:{crs}"
    if not isinstance(crs, dict):
        raise ValueError(f"the member 'crs' must be an object, got {type(crs).__name__}")
    properties, ident = crs.get("properties"), crs.get("id")
    inside: dict[str, Any] = properties if isinstance(properties, dict) else {}
    if "code" in inside:
        return f"EPSG:{inside['code']}"
    given: dict[str, Any] = ident if isinstance(ident, dict) else {}
    if "code" in given:
        return f"{given.get('authority', 'EPSG')}:{given['code']}"
    return str(inside.get("name") or crs.get("name") or inside.get("href") or crs).strip()
