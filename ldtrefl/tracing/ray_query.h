// A ray as it is searched for in an object, as ``Query`` of tracer.py has it.

struct RayQuery : Vectors {
    // In the object's unit space: hits at 0 <= t < t_max count.
    struct Query {
        double origin[3];
        float direction[3], t_max;
    };
};
