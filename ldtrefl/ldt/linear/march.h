// The paper's search of a ray in sorted maps (march.py): linear search, then bisection, in up to three maps.

struct LinearSearch : Samples {
    // Where between two samples, ``inside`` at the first, the map changes; the interval is halved in place.
    SHARED void bisect(
        const Maps& maps, const Ray& ray, int axis, bool inside, int halvings, float& before, float& after
    ) {
        const int goes_up = ray.goes_up[axis];
        const Texel at_before = texel_of(maps, ray, axis, before), at_after = texel_of(maps, ray, axis, after);
        const bool is_one = at_before.number == at_after.number;
        Texel texel = at_after;
        int from = 0, to = 0;
        if (is_one) {
            const int a = first_beyond(maps, texel.first, texel.end, coordinate(ray, axis, before));
            const int b = first_beyond(maps, texel.first, texel.end, coordinate(ray, axis, after));
            from = a < b ? a : b;
            to = a < b ? b : a;
        }
        for (int k = 0; k < halvings; ++k) {
            const float middle = 0.5f * (before + after);
            bool now;
            if (is_one) {
                const int beyond = first_beyond(maps, from, to, coordinate(ray, axis, middle));
                now = is_inside(maps, texel, beyond, goes_up);
            } else {
                now = inside_at(maps, ray, axis, middle);
            }
            if (now != inside) after = middle;
            else before = middle;
        }
    }

    // Algorithm 1 of the paper in the map of one axis from sample ``i`` on: linear search, then bisection.
    SHARED Crossing search_map(
        const Maps& maps, const Ray& ray, int axis, bool inside, float i, int halvings, int& steps
    ) {
        UNFUSED
        // A texel's error can put an origin on the surface inside the object: the way out is then no crossing. Deep
        // inside (a room seen from within) it is.
        bool counts = !inside || nearest_fragment(maps, ray, axis, 0.0f, {0.0f, INFINITY, -1}).residual > DEEP;
        for (; (i = next_change(maps, ray, 1 << axis, inside, i, steps)) <= ray.last; i += 1.0f) {
            float after = t_of_sample(ray, i);
            float before = after - ray.step;
            bisect(maps, ray, axis, inside, halvings, before, after);
            if (counts) {
                Crossing found = nearest_fragment(maps, ray, axis, after, {after, INFINITY, -1});
                found = nearest_fragment(maps, ray, axis, before, found);
                if (found.residual <= CONSISTENT) return found;
            }
            inside = !inside;
            counts = true;
        }
        return {INFINITY, INFINITY, -1};
    }

    // The nearest crossing that a map confirms; with ``any_hit`` the first that is found before t_max.
    SHARED Crossing search(
        const Maps& maps, Ray& ray, float t_exit, float t_max, bool any_hit, int linear_steps, int halvings, int& steps
    ) {
        place_samples(ray, maps, t_exit, linear_steps);
        int axes = 0, starts_inside = 0;  // a bit for each map: yet to be searched; says that the ray starts inside
        for (int axis = 0; axis < 3; ++axis) {
            if (ray.direction[axis] == 0.0f) continue;
            axes |= 1 << axis;
            if (ray.t_enter == 0.0f && inside_at(maps, ray, axis, 0.0f)) starts_inside |= 1 << axis;
        }
        Crossing best = {INFINITY, INFINITY, -1};
        float first = 0.0f;  // sample before which no map that is left sees a change; 0 if that is not known
        for (int axis = 0; axis < 3; ++axis) {
            if (!(axes >> axis & 1)) continue;
            if (first == 0.0f) first = starts_inside ? 1.0f : next_change(maps, ray, axes, false, 1.0f, steps);
            const Crossing found = search_map(maps, ray, axis, starts_inside >> axis & 1, first, halvings, steps);
            axes &= ~(1 << axis);
            starts_inside &= axes;
            if (found.fragment >= 0) {
                best = found;
                // What another map finds is nearer, but for the rounding of its last sample.
                if (any_hit && best.t * ROUNDED_UP < t_max) return best;
                // The other maps need look no farther, and share out a shorter way.
                place_samples(ray, maps, found.t, linear_steps);
                first = 0.0f;
            }
        }
        return best;
    }
};
