"""Interpolation in the force map and in the schedule of gains."""

from vehicle_model.compiled import compiled

__all__ = ["map_lookup", "schedule_lookup"]


@compiled
def place(value: float, first: float, step: float, count: float) -> tuple[int, float]:
    """Cell of a regular axis and the position 0..1 in it; values beyond the ends count as the ends."""
    x = min(max((value - first) / step, 0.0), count - 1.0)
    cell = min(int(x), int(count) - 2)
    return cell, x - cell


@compiled
def map_lookup(table, axes, u: float, w: float, force_x: float, force_z: float, node) -> None:
    """Fill `node` (columns,) from the force map, linear in airflow [m/s] and force per mass [m/s^2]."""
    iu, fu = place(u, axes[0, 0], axes[0, 1], axes[0, 2])
    iw, fw = place(w, axes[1, 0], axes[1, 1], axes[1, 2])
    ix, fx = place(force_x, axes[2, 0], axes[2, 1], axes[2, 2])
    iz, fz = place(force_z, axes[3, 0], axes[3, 1], axes[3, 2])
    for k in range(node.shape[0]):
        node[k] = 0.0
    for a in range(2):
        wa = fu if a == 1 else 1.0 - fu
        for b in range(2):
            wb = wa * (fw if b == 1 else 1.0 - fw)
            for c in range(2):
                wc = wb * (fx if c == 1 else 1.0 - fx)
                for d in range(2):
                    share = wc * (fz if d == 1 else 1.0 - fz)
                    if share > 0.0:
                        corner = table[iu + a, iw + b, ix + c, iz + d]
                        for k in range(node.shape[0]):
                            node[k] += share * corner[k]


@compiled
def schedule_lookup(schedule, axes, u: float, row) -> None:
    """Fill `row` (columns,) from the schedule, linear in the forward airflow [m/s] along the map's first axis."""
    cell, share = place(u, axes[0, 0], axes[0, 1], axes[0, 2])
    for k in range(row.shape[0]):
        row[k] = (1.0 - share) * schedule[cell, k] + share * schedule[cell + 1, k]
