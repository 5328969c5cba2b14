"""Ray against occupancy grid (``grid.py``): ``march_exact``, a walk through the occupied cells, nearest first.

Empty bricks are leapt over; the records of a cell are tested eight at a time; the first that is met is the answer.
``search_grid`` sends a ray on that grazes the back of a closed object's patch.
"""

from __future__ import annotations

import warp as wp

from ldtrefl.grid import BRICK, CELLS, LANES, ROWS, SMALL_PATCH, TRIANGLE, GridView
from ldtrefl.shade import barycentrics_at, brought_inside
from ldtrefl.trace import Hit, Tracer, no_hit

CELL_SLACK = wp.constant(1.0e-4)
"""Cells by which cells overlap along the ray: ten roundings of a coordinate in a grid of 128."""

EDGE_SLACK = wp.constant(1.0e-5)
"""Barycentric units by which records are widened, so that no ray slips between two triangles that share an edge."""

GRAZING = wp.constant(0.35)
"""n . direction below which a hit on the back of a closed object's patch is doubted, see ``search_grid``."""

HORIZON = wp.constant(0.1)
"""Cells after a doubted hit from where the search goes on: a third of a patch."""

NEGLIGIBLE = wp.constant(1.0e-18)
"""Component of a unit direction below which the ray runs along the planes: it would cross a cell in 1e18 cells."""

FAR = wp.constant(1.0e30)
"""The t of planes that are never reached."""

PER_BRICK = wp.constant(0.25)
"""Bricks in a cell."""


MEET_BLOCKS = """
    const int lanes = 8;
    float nearest[lanes];
    int where[lanes];
    for (int i = 0; i < lanes; ++i) { nearest[i] = NO_HIT; where[i] = -1; }
    for (int block = first_block; block < end_block; ++block) {
        const float* r = rows.data + (size_t)block * (13 * lanes);
        for (int i = 0; i < lanes; ++i) {
            float slope = r[i] * dx + r[lanes + i] * dy + r[2 * lanes + i] * dz;
            float height = r[3 * lanes + i] - (r[i] * ox + r[lanes + i] * oy + r[2 * lanes + i] * oz);
            float t = height / slope;
            float x = ox + t * dx, y = oy + t * dy, z = oz + t * dz;
            float u = r[4 * lanes + i] * x + r[5 * lanes + i] * y + r[6 * lanes + i] * z + r[7 * lanes + i];
            float v = r[8 * lanes + i] * x + r[9 * lanes + i] * y + r[10 * lanes + i] * z + r[11 * lanes + i];
            bool inside = (t >= t_min) & (t <= t_max) & (u >= -slack) & (v >= -slack) & (u <= 1.0f + slack)
                & (v <= 1.0f + slack) & (u + v <= r[12 * lanes + i] + slack) & (t < nearest[i])
                & (slope * slope > EDGE_ON);
            nearest[i] = inside ? t : nearest[i];
            where[i] = inside ? block - first_block : where[i];
        }
    }
    float t = NO_HIT;
    for (int i = 0; i < lanes; ++i) t = nearest[i] < t ? nearest[i] : t;
    int record = -1;
    if (t < NO_HIT) {
        for (int i = lanes - 1; i >= 0; --i) record = nearest[i] == t ? where[i] * lanes + i : record;
    }
    return wp::vec2(t, (float)record);
""".replace("NO_HIT", "3.0e38f").replace("EDGE_ON", "4.0e-14f")


@wp.func_native(MEET_BLOCKS)
def meet_blocks(
    rows: wp.array(dtype=wp.float32),
    first_block: int,
    end_block: int,
    ox: float,
    oy: float,
    oz: float,
    dx: float,
    dy: float,
    dz: float,
    t_min: float,
    t_max: float,
    slack: float,
) -> wp.vec2:
    """(t, record counted from the first block's) of the nearest record that a ray meets from ``t_min`` to ``t_max``;
    record -1 if none.

    Written in C++ so that the eight lanes become one vector, and the blocks do not wait for each other: a Warp loop
    tests records one by one, at three times the time. A record seen edge on, to float32's rounding of n . direction, is
    not met: nothing is known of where.
    """
    ...


@wp.struct
class GridHit:
    """The record that a ray meets first."""

    t: float
    fragment: int  # its place among the records, -1 for none
    local: wp.vec3  # the point in the brick's coordinates
    steps: int  # bricks entered and blocks tested


@wp.struct
class GridRay:
    """A ray that has entered an object's box; t counts from the entry, which keeps far rays precise."""

    entry: wp.vec3
    direction: wp.vec3
    inverse: wp.vec3  # 1 / direction, 0 along planes that the ray never crosses
    never: wp.vec3  # added to a plane's t: far for those planes
    forward: wp.vec3i  # 1 along axes that the ray goes up, 0 down
    t_enter: float  # before the entry
    t_end: float  # negative if the ray misses the box


@wp.func
def enter_grid(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> GridRay:
    """Slab test against an object's box, cell space."""
    ray = GridRay()
    t_enter = float(0.0)
    t_exit = t_max
    inverse = wp.vec3(0.0)
    never = wp.vec3(0.0)
    for axis in range(3):
        low, high = views[index].low[axis] - CELL_SLACK, views[index].high[axis] + CELL_SLACK
        if wp.abs(direction[axis]) < NEGLIGIBLE:
            never[axis] = FAR
            if origin[axis] < low or origin[axis] > high:
                t_exit = -1.0
        else:
            inverse[axis] = 1.0 / direction[axis]
            t_low, t_high = (low - origin[axis]) * inverse[axis], (high - origin[axis]) * inverse[axis]
            t_enter = wp.max(t_enter, wp.min(t_low, t_high))
            t_exit = wp.min(t_exit, wp.max(t_low, t_high))
    if not t_enter <= t_exit:
        ray.t_end = -1.0
        return ray
    ray.t_enter = t_enter
    ray.t_end = t_exit - t_enter
    ray.entry = origin + t_enter * direction
    ray.direction = direction
    ray.inverse = inverse
    ray.never = never
    ray.forward = wp.vec3i(
        wp.where(direction[0] > 0.0, 1, 0), wp.where(direction[1] > 0.0, 1, 0), wp.where(direction[2] > 0.0, 1, 0)
    )
    return ray


@wp.func
def walk_brick(
    views: wp.array(dtype=GridView), index: int, ray: GridRay, number: int, local: wp.vec3, t: float
) -> GridHit:
    """Walk the cells of an occupied brick, in its own coordinates, from ``local``, where the ray enters it at ``t``.

    The hit's t counts from there.
    """
    found = GridHit()
    found.fragment = -1
    fx, fy, fz = ray.forward[0], ray.forward[1], ray.forward[2]
    ix, iy, iz = ray.inverse[0], ray.inverse[1], ray.inverse[2]
    ux, uy, uz = ray.never[0], ray.never[1], ray.never[2]
    mask = views[index].mask[number]
    cx, cy, cz = wp.clamp(int(local[0]), 0, 3), wp.clamp(int(local[1]), 0, 3), wp.clamp(int(local[2]), 0, 3)
    tx = (float(cx + fx) - local[0]) * ix + ux
    ty = (float(cy + fy) - local[1]) * iy + uy
    tz = (float(cz + fz) - local[2]) * iz + uz
    t_in = float(0.0)
    inside = bool(True)
    while inside:
        cell = (cz * BRICK + cy) * BRICK + cx
        t_out = wp.min(tx, wp.min(ty, tz))
        if ((mask >> wp.uint64(cell)) & wp.uint64(1)) != wp.uint64(0):
            first_block = views[index].block[CELLS * number + cell]
            end_block = views[index].block[CELLS * number + cell + 1]
            hit = meet_blocks(
                views[index].rows,
                first_block,
                end_block,
                local[0],
                local[1],
                local[2],
                ray.direction[0],
                ray.direction[1],
                ray.direction[2],
                wp.max(t_in - CELL_SLACK, -t),
                wp.min(t_out + CELL_SLACK, ray.t_end - t),
                EDGE_SLACK,
            )
            found.steps += end_block - first_block
            if hit[1] >= 0.0:
                found.fragment = LANES * first_block + int(hit[1])
                found.t = hit[0]
                found.local = local + hit[0] * ray.direction
                return found
        t_in = t_out
        if tx <= ty and tx <= tz:
            cx += 2 * fx - 1
            inside = cx >= 0 and cx <= 3
            tx = (float(cx + fx) - local[0]) * ix + ux
        elif ty <= tz:
            cy += 2 * fy - 1
            inside = cy >= 0 and cy <= 3
            ty = (float(cy + fy) - local[1]) * iy + uy
        else:
            cz += 2 * fz - 1
            inside = cz >= 0 and cz <= 3
            tz = (float(cz + fz) - local[2]) * iz + uz
    return found


@wp.func
def side_of_leap(ray: GridRay, axis: int, brick: int, leap: int) -> float:
    """The t at which a ray leaves, along an axis, the cube of ``leap`` bricks that begins with ``brick``."""
    side = wp.where(ray.forward[axis] == 1, brick + leap, brick - leap + 1)
    return (float(BRICK * side) - ray.entry[axis]) * ray.inverse[axis] + ray.never[axis]


@wp.func
def index_beside(ray: GridRay, axis: int, brick: int, leap: int, t: float, bricks: int) -> int:
    """A brick's index at ``t`` along an axis other than the one that the cube of ``leap`` bricks is left along: brought
    into the cube, and into the grid, whatever the rounding."""
    if leap == 1:
        return brick
    index = int((ray.entry[axis] + t * ray.direction[axis]) * PER_BRICK)
    if ray.forward[axis] == 1:
        return wp.clamp(index, brick, wp.min(brick + leap, bricks) - 1)
    return wp.clamp(index, wp.max(brick - leap + 1, 0), brick)


@wp.func
def march_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> GridHit:
    """Walk the occupied cells along a ray, nearest first; the first record met is the answer.

    Object ``index``, cell space, ``direction`` of unit length. All indices are stepped as integers and every plane's t
    is computed from its index, so nothing adds up and nothing stalls.
    """
    nothing = GridHit()
    nothing.t = float(wp.inf)
    nothing.fragment = -1
    ray = enter_grid(views, index, origin, direction, t_max)
    if ray.t_end < 0.0:
        return nothing
    steps = int(0)
    nx, ny, nz = views[index].bricks[0], views[index].bricks[1], views[index].bricks[2]
    octant = (ray.forward[0] + 2 * ray.forward[1] + 4 * ray.forward[2]) * nx * ny * nz
    bx = wp.clamp(int(ray.entry[0] * PER_BRICK), 0, nx - 1)
    by = wp.clamp(int(ray.entry[1] * PER_BRICK), 0, ny - 1)
    bz = wp.clamp(int(ray.entry[2] * PER_BRICK), 0, nz - 1)
    t = float(0.0)
    inside = bool(True)
    while inside and t <= ray.t_end:
        brick = (bz * ny + by) * nx + bx
        leap = int(views[index].leaps[octant + brick])
        steps += 1
        if leap == 0:
            leap = 1
            local = ray.entry + t * direction - float(BRICK) * wp.vec3(float(bx), float(by), float(bz))
            found = walk_brick(views, index, ray, views[index].brick[brick], local, t)
            steps += found.steps
            if found.fragment >= 0:
                found.t = wp.max(ray.t_enter + (t + found.t), 0.0)
                found.steps = steps
                return found
        # Leave the cube of ``leap`` bricks ahead through the nearest of its far sides.
        tx, ty, tz = side_of_leap(ray, 0, bx, leap), side_of_leap(ray, 1, by, leap), side_of_leap(ray, 2, bz, leap)
        t = wp.max(t, wp.min(tx, wp.min(ty, tz)))
        if tx <= ty and tx <= tz:
            by = index_beside(ray, 1, by, leap, t, ny)
            bz = index_beside(ray, 2, bz, leap, t, nz)
            bx += (2 * ray.forward[0] - 1) * leap
            inside = bx >= 0 and bx < nx
        elif ty <= tz:
            bx = index_beside(ray, 0, bx, leap, t, nx)
            bz = index_beside(ray, 2, bz, leap, t, nz)
            by += (2 * ray.forward[1] - 1) * leap
            inside = by >= 0 and by < ny
        else:
            bx = index_beside(ray, 0, bx, leap, t, nx)
            by = index_beside(ray, 1, by, leap, t, ny)
            bz += (2 * ray.forward[2] - 1) * leap
            inside = bz >= 0 and bz < nz
    nothing.steps = steps
    return nothing


@wp.func
def record_coordinates(views: wp.array(dtype=GridView), index: int, found: GridHit, point: wp.vec3) -> wp.vec2:
    """Barycentrics of a hit: a triangle's record, still in the cache, knows them."""
    block, lane = found.fragment / LANES, found.fragment % LANES
    row = LANES * ROWS * block + lane
    kind = views[index].rows[row + 12 * LANES]
    if kind == SMALL_PATCH:
        return wp.vec2(-1.0, -1.0)
    if kind == TRIANGLE:
        p = found.local
        u = (
            views[index].rows[row + 4 * LANES] * p[0]
            + views[index].rows[row + 5 * LANES] * p[1]
            + views[index].rows[row + 6 * LANES] * p[2]
        )
        v = (
            views[index].rows[row + 8 * LANES] * p[0]
            + views[index].rows[row + 9 * LANES] * p[1]
            + views[index].rows[row + 10 * LANES] * p[2]
        )
        return brought_inside(u + views[index].rows[row + 7 * LANES], v + views[index].rows[row + 11 * LANES])
    corners = views[index].faces[views[index].triangle[found.fragment]]
    return barycentrics_at(
        views[index].vertices[corners[0]], views[index].vertices[corners[1]], views[index].vertices[corners[2]], point
    )


@wp.func
def record_normal(views: wp.array(dtype=GridView), index: int, fragment: int) -> wp.vec3:
    """Unit normal of a record."""
    row = LANES * ROWS * (fragment / LANES) + fragment % LANES
    return wp.vec3(views[index].rows[row], views[index].rows[row + LANES], views[index].rows[row + 2 * LANES])


@wp.func
def facing(views: wp.array(dtype=GridView), index: int, direction: wp.vec3, found: GridHit) -> float:
    """n . direction, the normal n pointing out of a closed object; 0 on a miss, or if the object is not closed."""
    if found.fragment < 0:
        return 0.0
    return views[index].front * wp.dot(record_normal(views, index, found.fragment), direction)


@wp.func
def search_grid(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> GridHit:
    """:func:`march_exact`, over the horizon where patches stick out past it.

    From outside a closed object only the front of its surface is seen. A ray that grazes a back has either passed just
    over the horizon, where the next patch sticks out by its margin, and goes on; or it started inside. Then any other
    ray from there meets a back too: one is sent to see.
    """
    found = GridHit()
    start, way, limit = origin, direction, t_max
    passed = float(0.0)
    steps = int(0)
    probing = bool(False)
    searching = bool(True)
    while searching:
        searching = False
        met = march_exact(views, index, start, way, limit)
        steps += met.steps
        back = facing(views, index, way, met)
        if not probing:
            found = met
            found.t += passed
            if back > 0.0 and back < GRAZING:
                probing = True
                way = wp.normalize(wp.cross(direction, record_normal(views, index, met.fragment)))
                limit = FAR
                searching = True
        elif back <= 0.0:
            probing = False
            passed = found.t + HORIZON
            start = origin + passed * direction
            way = direction
            limit = t_max - passed
            searching = True
    found.steps = steps
    return found


@wp.func
def closest_hit_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> Hit:
    """The tracer's ``closest_hit`` by :func:`search_grid`."""
    scale = views[index].cells_per_unit
    hit = no_hit()
    found = search_grid(views, index, scale * origin + views[index].cell_offset, direction, scale * t_max)
    hit.steps = found.steps
    if found.fragment >= 0:
        hit.t = found.t / scale
        hit.triangle = views[index].triangle[found.fragment]
        hit.normal = record_normal(views, index, found.fragment)
        uv = record_coordinates(views, index, found, origin + hit.t * direction)
        hit.u = uv[0]
        hit.v = uv[1]
    return hit


@wp.func
def occluded_exact(
    views: wp.array(dtype=GridView), index: int, origin: wp.vec3, direction: wp.vec3, t_max: float
) -> bool:
    """The tracer's ``occluded`` by :func:`march_exact`."""
    return closest_hit_exact(views, index, origin, direction, t_max).triangle >= 0


EXACT = Tracer("exact", GridView, closest_hit_exact, occluded_exact, clearance=1e-4)
