// The environment between two colours, for pixels in a row that see nothing else: as many at once as a vector has lanes
// (backdrop.py).

struct Backdrop : Vectors {
    // A row of pixels: ``middle`` is the direction of its middle, ``middle + right`` that of its right end.
    struct Row {
        float width, middle[3], right[3], up[3], ground[3], rise[3];  // rise: from the ground's colour to the sky's
    };

    // Write the radiance of ``count`` pixels from ``x`` on, three floats each.
    SHARED void fill(const Row& row, int x, int count, float* radiance) {
        FUSED
        Wide at;
        for (int i = 0; i < WIDE; ++i) at[i] = (float)(2 * (x + i) + 1) - row.width;
        for (int done = 0; done < count; done += WIDE, at = at + wide(2.0f * (float)WIDE)) {
            const Wide across = at / wide(row.width);
            Wide height = wide(0.0f), square = wide(0.0f);
            for (int k = 0; k < 3; ++k) {
                const Wide way = wide(row.middle[k]) + across * wide(row.right[k]);
                height = height + way * wide(row.up[k]);
                square = square + way * way;
            }
            const Wide blend = wide(0.5f) + wide(0.5f) * (height / root(square));
            const Wide red = wide(row.ground[0]) + blend * wide(row.rise[0]);
            const Wide green = wide(row.ground[1]) + blend * wide(row.rise[1]);
            const Wide blue = wide(row.ground[2]) + blend * wide(row.rise[2]);
            for (int i = 0; i < WIDE && done + i < count; ++i) {
                float* pixel = radiance + 3 * (done + i);
                pixel[0] = red[i];
                pixel[1] = green[i];
                pixel[2] = blue[i];
            }
        }
    }
};
