// The mean of each pixel and its eight neighbours, for a row of pixels (antialiasing.py).

struct Smooth : Vectors {
    // ``count`` floats from ``row`` on, whose pixels have neighbours on all sides; ``stride`` floats make a row.
    SHARED void blend(const float* row, int stride, int count, const float* weights, float* out) {
        const float* const above = row - stride;
        const float* const below = row + stride;
        const float corner = weights[0], upright = weights[1], beside = weights[3], middle = weights[4];
        for (int i = 0; i < count; ++i) {
            const float corners = above[i - 3] + above[i + 3] + below[i - 3] + below[i + 3];
            out[i] = middle * row[i] + beside * (row[i - 3] + row[i + 3]) + upright * (above[i] + below[i]) +
                     corner * corners;
        }
    }
};
