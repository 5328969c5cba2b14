// What microfacets mirror of lights (finish.py, which says where the formulas are from).

struct Highlights {
    struct Three { float x, y, z; };

    CUDA_CALLABLE static inline float dot(const Three& a, const Three& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
    CUDA_CALLABLE static inline Three unit(const Three& a) {
        const float square = dot(a, a), scale = square > 0.0f ? 1.0f / sqrtf(square) : 0.0f;
        return {scale * a.x, scale * a.y, scale * a.z};
    }

    // How much of a light in unit direction ``towards`` microfacets mirror if they reflect all of it, in units of what a
    // white surface that faces the light scatters; ``grazing`` is Schlick's share of the reflectance along the surface.
    // The way to the viewer is 0 if the eye touches the surface.
    CUDA_CALLABLE static inline float mirrored(
        float alpha, const Three& normal, const Three& towards, const Three& to_viewer, float& grazing
    ) {
        const float of_light = dot(normal, towards);
        if (!(of_light > 0.0f)) return 0.0f;
        const float towards_viewer = dot(normal, to_viewer);
        const float of_view = towards_viewer > LEAST_COSINE ? towards_viewer : LEAST_COSINE;
        const Three half = unit({towards.x + to_viewer.x, towards.y + to_viewer.y, towards.z + to_viewer.z});
        const Three across = {
            normal.y * half.z - normal.z * half.y, normal.z * half.x - normal.x * half.z,
            normal.x * half.y - normal.y * half.x
        };
        const float cosine = dot(normal, half), square = alpha * alpha;
        // 1 - cosine^2 from the sine itself: near the middle of a highlight the difference would be rounded away.
        const float spread = square * cosine * cosine + dot(across, across);
        const float density = square / (spread * spread);  // times pi: a white surface scatters 1 / pi
        const float masked = of_light * sqrtf(of_view * of_view * (1.0f - square) + square) +
            of_view * sqrtf(of_light * of_light * (1.0f - square) + square);
        const float far = 1.0f - dot(to_viewer, half), positive = far > 0.0f ? far : 0.0f;
        grazing = positive * positive * positive * positive * positive;
        return of_light * density * 0.5f / masked;
    }
};
