"""The vehicle's MAVLink side: links, dialect, and one file for each microservice, named as the MAVLink guide names it.

`MavlinkFace` is all that the rest of the process needs.
"""

from sitl.mavlink.face import MavlinkFace
from sitl.mavlink.links import LinkError, LinkSpec, parse_link

__all__ = ["LinkError", "LinkSpec", "MavlinkFace", "parse_link"]
