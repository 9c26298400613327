"""For those who test their own MAVLink programs: the vehicle as a pytest fixture, on a wire that can fail.

`sitl.testing.plugin` is what pytest loads. `SitlVehicle` is the same without pytest, and is loaded when first asked
for: pytest loads this package in every run, also where nobody wants a vehicle.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sitl.testing.process import SitlError
    from sitl.testing.vehicle import SitlVehicle

__all__ = ["SitlError", "SitlVehicle"]


def __getattr__(name: str) -> Any:
    if name == "SitlVehicle":
        from sitl.testing.vehicle import SitlVehicle

        return SitlVehicle
    if name == "SitlError":
        from sitl.testing.process import SitlError

        return SitlError
    msg = f"module {__name__!r} has no attribute {name!r}"
    raise AttributeError(msg)
