"""Contact of the landing gear with the ground: enough to stand, slide, tip and land.

Each contact point is a spring and damper across the ground plane and Coulomb friction along it. The ground is the
plane at `ground_height` below the vehicle, square to the origin's down axis.
"""

import math

from vehicle_model.compiled import compiled

__all__ = ["contact_force"]

# Below this sliding speed [m/s] friction falls to zero in proportion, so that it has no jump at rest. So nothing stands
# quite still against a push F: it creeps at s F/sqrt(N^2 mu^2 - F^2) with s this speed. A smaller s would be too stiff
# for RK4 at 400 Hz.
STICTION_SPEED = 0.02


@compiled
def contact_force(contact, depth: float, sinking: float, north: float, east: float) -> tuple[float, float, float]:
    """Force on the vehicle, NED axes [N], of a CONTACT record whose point is `depth` below the ground [m].

    `sinking`, `north`, `east` are the point's velocity over the ground [m/s]. The ground pushes and never pulls.
    """
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    press = max(contact.stiffness * depth + contact.damping * sinking, 0.0)
    grip = contact.friction * press / math.sqrt(north * north + east * east + STICTION_SPEED * STICTION_SPEED)
    return -grip * north, -grip * east, -press
