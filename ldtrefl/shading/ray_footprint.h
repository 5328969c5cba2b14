// Footprints of rays where they meet one object: as many at once as a vector has lanes (ray_footprint.py).

struct RayFootprints : Surfaces {
    // From a ray to that of a neighbouring pixel.
    struct Apart { Three place, turn; };

    // What neighbours see of a triangle's plane.
    struct Met {
        Three place;
        Wide spread_u, spread_v;
        Three normal_turn;
    };

    SHARED Three plus(const Three& a, const Three& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

    // By how much the camera's rays turn to those of the next pixel, which are ``step`` away where their length along the
    // camera's axis is 1; ``along`` are the rays' unit directions, and ``length`` their lengths there (equation 8).
    SHARED Apart from_eye(const float* step, const Three& along, Wide length) {
        FUSED
        const Three apart = times(wide(1.0f) / length, {wide(step[0]), wide(step[1]), wide(step[2])});
        const Wide zero = wide(0.0f);
        return {{zero, zero, zero}, minus(apart, times(dot(apart, along), along))};
    }

    // From where a ray meets a plane, after ``t``, to where its neighbour does (equations 10 and 12). ``nearer`` is -1
    // over the cosine of the plane's normal with the ray.
    SHARED Three place_on_plane(const Apart& of, const Three& view, Wide t, const Three& facet, Wide nearer) {
        FUSED
        const Three apart = plus(of.place, times(t, of.turn));
        return plus(apart, times(dot(apart, facet) * nearer, view));
    }

    // A triangle's edges, and what divides areas by its own; 0 if it has none.
    struct Edges { Three e, f; Wide ee, ef, ff, scale; };
    SHARED Edges edges_of(const Points& at) {
        FUSED
        Edges made;
        made.e = minus(at.corner[1], at.corner[0]);
        made.f = minus(at.corner[2], at.corner[0]);
        made.ee = dot(made.e, made.e);
        made.ef = dot(made.e, made.f);
        made.ff = dot(made.f, made.f);
        const Wide area = made.ee * made.ff - made.ef * made.ef, zero = wide(0.0f);
        made.scale = chosen(area > zero, wide(1.0f) / area, zero);
        return made;
    }

    // What a neighbour sees of points' planes. ``unit_from_direction`` takes ways into the mesh's own units.
    SHARED Met met_by(
        const Object& object, const float* unit_from_direction, float units, const Points& at, const Edges& edges,
        const Three& normal, const Three& place
    ) {
        FUSED
        Met made;
        made.place = place;
        const Three way = times(wide(units), transformed(unit_from_direction, place));
        const Wide along_e = dot(way, edges.e), along_f = dot(way, edges.f);
        made.spread_u = (edges.ff * along_e - edges.ef * along_f) * edges.scale;
        made.spread_v = (edges.ee * along_f - edges.ef * along_e) * edges.scale;
        const Wide zero = wide(0.0f);
        made.normal_turn = {zero, zero, zero};
        if (object.normals) {
            const Three* const n = at.corner_normal;
            const Three change =
                plus(times(made.spread_u, minus(n[1], n[0])), times(made.spread_v, minus(n[2], n[0])));
            const Three across = transformed(object.normal_from_unit, blended(at.weight, n));
            const Wide square = dot(across, across), shrunk = wide(1.0f) / root(square);
            const Wide scale = chosen(square > zero, chosen(dot(across, normal) < zero, -shrunk, shrunk), zero);
            const Three turn = times(scale, transformed(object.normal_from_unit, change));
            made.normal_turn = minus(turn, times(dot(turn, normal), normal));
        }
        return made;
    }
};
