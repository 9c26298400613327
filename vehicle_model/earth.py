"""The Earth as a parameter of one set of equations: flat, round, or the rotating WGS-84 ellipsoid with J2 gravity.

For all three the vehicle lives in the NED frame tangent at the environment's origin and fixed to the Earth. On a flat
Earth gravity is constant along down, and latitude and longitude are a map with constant scale. A round Earth is an
ellipsoid without eccentricity or J2, so the curved functions serve both. They work with the position from the origin
rather than from the Earth's centre wherever two lengths of 6400 km would cancel.

Sources: NIMA TR8350.2 (WGS-84); Bowring (1976), "Transformation from spatial to geographical coordinates";
NASA/TM-2015-218675 for the constants of its check-cases.
"""

import math
from typing import Literal

import numpy as np

from vehicle_model.compiled import compiled
from vehicle_model.records import ENVIRONMENT
from vehicle_model.rotation import Quaternion, Vector, quaternion_multiply

__all__ = [
    "FLAT", "ROUND", "STANDARD_GRAVITY", "WGS84", "geodetic", "gravitation", "height_above_ellipsoid", "local_axes",
    "make_environment", "ned_from_geodetic",
]  # fmt: skip

FLAT, ROUND, WGS84 = 0, 1, 2  # values of the field `earth`

GM = 3.986004418e14  # [m^3/s^2]
J2 = 1.08262982e-3
EQUATORIAL_RADIUS = 6378137.0  # [m]
FLATTENING = 1.0 / 298.257223563
ROTATION = 7.292115e-5  # [rad/s]
MEAN_RADIUS = 6371007.1809  # of the sphere with the ellipsoid's area [m]
STANDARD_GRAVITY = 9.80665  # [m/s^2]


def make_environment(
    earth: Literal["flat", "round", "wgs84"],
    *,
    latitude: float,
    longitude: float,
    height_ellipsoid: float,
    wind_ned: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ground_height: float | None = None,
    rotating: bool | None = None,
    gravity: float = STANDARD_GRAVITY,
) -> np.ndarray:
    """ENVIRONMENT array of shape (1,) with its NED origin at a geodetic latitude and longitude [rad] and height [m].

    `wind_ned` is the steady wind [m/s] in the origin's axes, blowing to; `ground_height` is that of the ground above
    the ellipsoid [m], by default the origin's. `rotating` is by default False on a flat Earth and True otherwise.
    `gravity` [m/s^2] counts on a flat Earth only.

    Raises ValueError for an unknown Earth, a rotating flat one, values that are not finite, a latitude beyond the
    poles, or a latitude within 0.1 deg of a pole on a flat Earth, whose map ends there.
    """
    kinds = {"flat": FLAT, "round": ROUND, "wgs84": WGS84}
    if earth not in kinds:
        raise ValueError(f"earth: expected one of {', '.join(kinds)}, got {earth!r}")
    if rotating is None:
        rotating = earth != "flat"
    if rotating and earth == "flat":
        raise ValueError("rotating: a flat Earth cannot rotate; expected earth = round or wgs84")
    if ground_height is None:
        ground_height = height_ellipsoid
    scalars = {
        "longitude": longitude,
        "height_ellipsoid": height_ellipsoid,
        "ground_height": ground_height,
        "gravity": gravity,
    }
    for name, value in scalars.items():
        if not math.isfinite(value):
            raise ValueError(f"{name}: expected a finite number, got {value}")
    if len(wind_ned) != 3 or not all(math.isfinite(component) for component in wind_ned):
        raise ValueError(f"wind_ned: expected three finite numbers in m/s (north, east, down), got {wind_ned}")
    limit = math.radians(89.9 if earth == "flat" else 90.0)
    if not abs(latitude) <= limit:
        raise ValueError(
            f"latitude: expected at most {math.degrees(limit):g} deg either way on a {earth} Earth,"
            f" got {math.degrees(latitude):g} deg"
        )

    environment = np.zeros(1, ENVIRONMENT)
    record = environment[0]
    record["earth"] = kinds[earth]
    record["gravity"] = gravity
    record["gm"] = GM
    record["equatorial_radius"] = EQUATORIAL_RADIUS
    record["eccentricity_squared"] = FLATTENING * (2.0 - FLATTENING)
    record["j2"] = J2
    if earth == "round":
        record["equatorial_radius"] = MEAN_RADIUS
        record["eccentricity_squared"] = 0.0
        record["j2"] = 0.0
    record["latitude"] = latitude
    record["longitude"] = math.remainder(longitude, 2.0 * math.pi)
    record["height_ellipsoid"] = height_ellipsoid
    sine, cosine = math.sin(latitude), math.cos(latitude)
    record["sin_latitude"], record["cos_latitude"] = sine, cosine
    if earth != "flat":
        prime_vertical = _prime_vertical(record, sine)
        from_axis = (prime_vertical + height_ellipsoid) * cosine
        from_equator = (prime_vertical * (1.0 - record["eccentricity_squared"]) + height_ellipsoid) * sine
        record["centre_ned"] = (
            sine * from_axis - cosine * from_equator, 0.0, cosine * from_axis + sine * from_equator
        )  # fmt: skip
    if rotating:
        record["rotation_ned"] = ROTATION * np.array([cosine, 0.0, -sine])
    record["wind_ned"] = wind_ned
    record["ground_height"] = ground_height
    return environment


@compiled
def _prime_vertical(environment, sine: float) -> float:
    """Radius of curvature N [m] of the ellipsoid, east-west, where the latitude has this sine."""
    return environment.equatorial_radius / math.sqrt(1.0 - environment.eccentricity_squared * sine * sine)


@compiled
def gravitation(north: float, east: float, down: float, environment) -> Vector:
    """Attraction of the Earth [m/s^2] at a NED position [m], in the origin's NED axes, without centrifugal part.

    Flat: constant along down. Otherwise, with r from the Earth's centre, its distance z from the equatorial plane and
    k = 3/2 J2 (a/r)^2, -GM/r^3 ((1 + k (1 - 5 z^2/r^2)) r + 2 k z axis): the gradient of the J2 potential.
    """
    if environment.earth == FLAT:
        return 0.0, 0.0, environment.gravity
    sine, cosine = environment.sin_latitude, environment.cos_latitude
    x = north - environment.centre_ned[0]
    y = east
    z = down - environment.centre_ned[2]
    square = x * x + y * y + z * z
    over_square = 1.0 / square
    along_axis = cosine * x - sine * z
    radius = environment.equatorial_radius
    k = 1.5 * environment.j2 * radius * radius * over_square
    pull = -environment.gm * over_square / math.sqrt(square)
    radial = pull * (1.0 + k * (1.0 - 5.0 * along_axis * along_axis * over_square))
    axial = pull * 2.0 * k * along_axis
    return radial * x + axial * cosine, radial * y, radial * z - axial * sine


@compiled
def _vertical(x: float, y: float, z: float, environment) -> tuple[float, float]:
    """Sine and cosine of the geodetic latitude of a point x, y from the equatorial plane's centre, z above it [m].

    Two of Bowring's steps: the first already leaves less than 1e-10 rad below 20 km, the second only rounding.
    """
    ratio = math.sqrt(1.0 - environment.eccentricity_squared)  # polar over equatorial radius, b/a
    bulge = environment.eccentricity_squared * environment.equatorial_radius  # e^2 a; e'^2 b is bulge / ratio
    from_axis = math.sqrt(x * x + y * y)
    # The parametric latitude starts from the direction to the centre, corrected to the height of the point.
    sine = z * (ratio + bulge / math.sqrt(from_axis * from_axis + z * z))
    cosine = from_axis
    for _ in range(2):
        scale = 1.0 / math.sqrt(sine * sine + cosine * cosine)
        sine *= scale
        cosine *= scale
        sine = ratio * z + bulge * sine * sine * sine
        cosine = from_axis - bulge * cosine * cosine * cosine
    sine /= ratio  # from the parametric to the geodetic latitude
    scale = 1.0 / math.sqrt(sine * sine + cosine * cosine)
    return sine * scale, cosine * scale


@compiled
def _from_centre(north: float, east: float, down: float, environment) -> Vector:
    """Position [m] from the Earth's centre: towards the origin's meridian on the equator, east of it, and north."""
    x = north - environment.centre_ned[0]
    z = down - environment.centre_ned[2]
    sine, cosine = environment.sin_latitude, environment.cos_latitude
    return -sine * x - cosine * z, east, cosine * x - sine * z


@compiled
def height_above_ellipsoid(north: float, east: float, down: float, environment) -> float:
    """Height [m] above the ellipsoid (or sphere, or flat ground plane) of a NED position [m].

    With u the outward normal at the point's foot on the ellipsoid and s the foot of the origin, the height is
    u.(position + h0 u0) + u.s - a W, where a W is how far the plane tangent at the point's foot is from the centre
    (W^2 = 1 - e^2 sin^2 latitude). Written with u - u0 and the difference of the feet, so that nothing cancels.
    """
    if environment.earth == FLAT:
        return environment.height_ellipsoid - down
    sine0, cosine0 = environment.sin_latitude, environment.cos_latitude
    x, y, z = _from_centre(north, east, down, environment)
    sine, cosine = _vertical(x, y, z, environment)
    over_axis_distance = 1.0 / max(math.sqrt(x * x + y * y), 1e-9)  # a pole has no longitude, but it has a height
    ux, uy, uz = cosine * x * over_axis_distance, cosine * y * over_axis_distance, sine
    climb = ux * (-sine0 * north - cosine0 * down) + uy * east + uz * (cosine0 * north - sine0 * down)
    turn = (ux - cosine0) ** 2 + uy**2 + (uz - sine0) ** 2

    ratio = math.sqrt(1.0 - environment.eccentricity_squared)
    w = math.sqrt(1.0 - environment.eccentricity_squared * sine * sine)
    w0 = math.sqrt(1.0 - environment.eccentricity_squared * sine0 * sine0)
    foot_turn = (ux / w - cosine0 / w0) ** 2 + (uy / w) ** 2 + (ratio * (uz / w - sine0 / w0)) ** 2
    height0 = environment.height_ellipsoid
    return height0 + climb - 0.5 * (height0 * turn + environment.equatorial_radius * w * foot_turn)


@compiled
def _map_scale(environment) -> tuple[float, float]:
    """Metres per radian of latitude and of longitude at the origin, by the ellipsoid's radii of curvature there."""
    prime_vertical = _prime_vertical(environment, environment.sin_latitude)
    w_square = (environment.equatorial_radius / prime_vertical) ** 2
    meridian = prime_vertical * (1.0 - environment.eccentricity_squared) / w_square
    height0 = environment.height_ellipsoid
    return meridian + height0, (prime_vertical + height0) * environment.cos_latitude


@compiled
def geodetic(north: float, east: float, down: float, environment) -> Vector:
    """Geodetic latitude and longitude (-pi..pi) [rad] and height above the ellipsoid [m] of a NED position [m].

    On a flat Earth the map has a constant scale: the radii of curvature of WGS-84 at the origin.
    """
    height = height_above_ellipsoid(north, east, down, environment)
    if environment.earth == FLAT:
        per_latitude, per_longitude = _map_scale(environment)
        latitude = environment.latitude + north / per_latitude
        from_origin = east / per_longitude
    else:
        x, y, z = _from_centre(north, east, down, environment)
        sine, cosine = _vertical(x, y, z, environment)
        latitude = math.atan2(sine, cosine)
        from_origin = math.atan2(y, x)
    return latitude, _wrapped(environment.longitude + from_origin), height


@compiled
def _wrapped(angle: float) -> float:
    """Angle [rad] within half a turn of zero; unchanged, to the last bit, if it was."""
    if abs(angle) <= math.pi:
        return angle
    return angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi) + 0.5)


@compiled
def ned_from_geodetic(latitude: float, longitude: float, height: float, environment) -> Vector:
    """NED position [m] of a geodetic latitude and longitude [rad] and height [m]: the inverse of `geodetic`."""
    east_turn = _wrapped(longitude - environment.longitude)
    climb = height - environment.height_ellipsoid
    if environment.earth == FLAT:
        per_latitude, per_longitude = _map_scale(environment)
        return (latitude - environment.latitude) * per_latitude, east_turn * per_longitude, -climb

    # Differences to the origin: of the sine and cosine of latitude, of N, and of the distances to axis and equator.
    sine0, cosine0 = environment.sin_latitude, environment.cos_latitude
    sine, cosine = math.sin(latitude), math.cos(latitude)
    half_turn = 0.5 * (latitude - environment.latitude)
    middle = 0.5 * (latitude + environment.latitude)
    sine_change = 2.0 * math.cos(middle) * math.sin(half_turn)
    cosine_change = -2.0 * math.sin(middle) * math.sin(half_turn)
    flattened = 1.0 - environment.eccentricity_squared
    n = _prime_vertical(environment, sine)
    n0 = _prime_vertical(environment, sine0)
    n_change = (
        environment.eccentricity_squared * (n * n0 / environment.equatorial_radius) ** 2
        * sine_change * (sine + sine0) / (n + n0)
    )  # fmt: skip
    from_axis = (n + height) * cosine
    axis_change = (n + height) * cosine_change + (n_change + climb) * cosine0
    equator_change = (n * flattened + height) * sine_change + (n_change * flattened + climb) * sine0

    x = axis_change - from_axis * 2.0 * math.sin(0.5 * east_turn) ** 2
    return cosine0 * equator_change - sine0 * x, from_axis * math.sin(east_turn), -cosine0 * x - sine0 * equator_change


@compiled
def local_axes(north: float, east: float, down: float, environment) -> Quaternion:
    """Unit quaternion that turns vectors from the origin's NED axes into the local geodetic NED axes at a position.

    Identity on a flat Earth. Local attitude is this quaternion times the state's; local velocity is `body_to_ned` of
    this quaternion and a velocity in the origin's axes.
    """
    if environment.earth == FLAT:
        return 1.0, 0.0, 0.0, 0.0
    latitude, longitude, _ = geodetic(north, east, down, environment)
    tilt = 0.5 * (latitude + 0.5 * math.pi)
    tilt0 = 0.5 * (environment.latitude + 0.5 * math.pi)
    turn = 0.5 * _wrapped(environment.longitude - longitude)
    # From the origin's NED to the equator and pole, round the axis, and down to the local NED.
    to_axis = (math.cos(turn) * math.cos(tilt0), math.sin(turn) * math.sin(tilt0),
               -math.cos(turn) * math.sin(tilt0), math.sin(turn) * math.cos(tilt0))  # fmt: skip
    return quaternion_multiply(math.cos(tilt), 0.0, math.sin(tilt), 0.0, *to_axis)
