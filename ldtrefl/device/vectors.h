// Vectors of four and of eight floats for native code: the compiler's own where it has them, loops where it has not.
//
// A base class of the classes in other files of native code. All of them stand in the bodies of native functions
// (native_sources.py), where only local classes may: they have no templates and no static members. PLAIN_VECTORS asks
// for the loops, which CUDA takes.

#if defined(__CUDA_ARCH__)
#define PLAIN_VECTORS
#endif

#if defined(PLAIN_VECTORS)
#define FUSED
#define UNFUSED
#define SHARED CUDA_CALLABLE static inline
#define OUT_OF_LINE CUDA_CALLABLE static
#else
#define FUSED _Pragma("clang fp contract(fast)")     // a * b + c is rounded once
#define UNFUSED _Pragma("clang fp contract(off)")    // and twice
#define SHARED static inline __attribute__((always_inline))
#define OUT_OF_LINE static __attribute__((noinline))
#endif

struct Vectors {
#if defined(PLAIN_VECTORS)
#define EACH(expression) for (int i = 0; i < N; ++i) made.x[i] = expression
#define VECTOR(Name, Flags, Count, Float, Int) \
    struct Flags { \
        enum { N = Count }; \
        Int x[N]; \
        CUDA_CALLABLE Int operator[](int i) const { return x[i]; } \
        CUDA_CALLABLE Flags operator&(const Flags& b) const { Flags made; EACH(x[i] & b.x[i]); return made; } \
        CUDA_CALLABLE Flags operator|(const Flags& b) const { Flags made; EACH(x[i] | b.x[i]); return made; } \
    }; \
    struct Name { \
        enum { N = Count }; \
        Float x[N]; \
        CUDA_CALLABLE Float& operator[](int i) { return x[i]; } \
        CUDA_CALLABLE Float operator[](int i) const { return x[i]; } \
        CUDA_CALLABLE Name operator-() const { Name made; EACH(-x[i]); return made; } \
        CUDA_CALLABLE Name operator+(const Name& b) const { Name made; EACH(x[i] + b.x[i]); return made; } \
        CUDA_CALLABLE Name operator-(const Name& b) const { Name made; EACH(x[i] - b.x[i]); return made; } \
        CUDA_CALLABLE Name operator*(const Name& b) const { Name made; EACH(x[i] * b.x[i]); return made; } \
        CUDA_CALLABLE Name operator/(const Name& b) const { Name made; EACH(x[i] / b.x[i]); return made; } \
        CUDA_CALLABLE Flags operator<(const Name& b) const { Flags made; EACH(-(x[i] < b.x[i])); return made; } \
        CUDA_CALLABLE Flags operator>(const Name& b) const { Flags made; EACH(-(x[i] > b.x[i])); return made; } \
        CUDA_CALLABLE Flags operator<=(const Name& b) const { Flags made; EACH(-(x[i] <= b.x[i])); return made; } \
        CUDA_CALLABLE Flags operator>=(const Name& b) const { Flags made; EACH(-(x[i] >= b.x[i])); return made; } \
        CUDA_CALLABLE Flags operator!=(const Name& b) const { Flags made; EACH(-(x[i] != b.x[i])); return made; } \
    }; \
    SHARED Name chosen(const Flags& is, const Name& a, const Name& b) { \
        Name made; \
        for (int i = 0; i < Count; ++i) made.x[i] = is.x[i] ? a.x[i] : b.x[i]; \
        return made; \
    } \
    SHARED Name truncated(const Name& a) { \
        Name made; \
        for (int i = 0; i < Count; ++i) made.x[i] = (Float)(int)a.x[i]; \
        return made; \
    }
    VECTOR(Four, FourFlags, 4, float, int)
    VECTOR(Eight, EightFlags, 8, float, int)
#if defined(__CUDA_ARCH__)
    VECTOR(One, OneFlags, 1, float, int)
    VECTOR(OneDouble, OneDoubleFlags, 1, double, long long)
#else
    VECTOR(EightDouble, EightDoubleFlags, 8, double, long long)
#endif
#undef VECTOR
#undef EACH
#else
    typedef float Four __attribute__((vector_size(16), aligned(4)));  // as it lies in arrays
    typedef int FourFlags __attribute__((vector_size(16)));
    typedef float Eight __attribute__((vector_size(32)));
    typedef int EightFlags __attribute__((vector_size(32)));  // of each lane 0 or -1
    typedef double EightDouble __attribute__((vector_size(64)));
    typedef long long EightDoubleFlags __attribute__((vector_size(64)));

    SHARED Four chosen(FourFlags is, Four a, Four b) { return is ? a : b; }
    SHARED Eight chosen(EightFlags is, Eight a, Eight b) { return is ? a : b; }
    SHARED EightDouble chosen(EightDoubleFlags is, EightDouble a, EightDouble b) { return is ? a : b; }
    SHARED Four truncated(Four a) { return __builtin_convertvector(__builtin_convertvector(a, FourFlags), Four); }
    SHARED Eight truncated(Eight a) { return __builtin_convertvector(__builtin_convertvector(a, EightFlags), Eight); }
#endif

    // As many lanes as a thread works on at once where all are alike.
#if defined(__CUDA_ARCH__)
    typedef One Wide;
    typedef OneFlags WideFlags;
    typedef OneDouble WideDouble;
    enum { WIDE = 1 };
#else
    typedef Eight Wide;
    typedef EightFlags WideFlags;
    typedef EightDouble WideDouble;
    enum { WIDE = 8 };
#endif
    SHARED Wide wide(float x) {
        Wide made;
        for (int i = 0; i < WIDE; ++i) made[i] = x;
        return made;
    }
    SHARED WideDouble wide_double(double x) {
        WideDouble made;
        for (int i = 0; i < WIDE; ++i) made[i] = x;
        return made;
    }
#if defined(PLAIN_VECTORS)
    SHARED WideDouble doubled(const Wide& a) {
        WideDouble made;
        for (int i = 0; i < WIDE; ++i) made[i] = a[i];
        return made;
    }
    SHARED Wide single(const WideDouble& a) {
        Wide made;
        for (int i = 0; i < WIDE; ++i) made[i] = (float)a[i];
        return made;
    }
#else
    SHARED WideDouble doubled(Wide a) { return __builtin_convertvector(a, WideDouble); }
    SHARED Wide single(WideDouble a) { return __builtin_convertvector(a, Wide); }
#endif
    SHARED Wide root(Wide v) {
#if !defined(PLAIN_VECTORS) && __has_builtin(__builtin_elementwise_sqrt)
        return __builtin_elementwise_sqrt(v);
#else
        for (int i = 0; i < WIDE; ++i) v[i] = sqrtf(v[i]);
        return v;
#endif
    }

    SHARED int as_int(float x) {
        int i;
        memcpy(&i, &x, 4);
        return i;
    }
    SHARED float as_float(int i) {
        float x;
        memcpy(&x, &i, 4);
        return x;
    }
    SHARED int lowest_bit(int word) {
#if defined(__CUDA_ARCH__)
        return __ffs(word) - 1;
#else
        return __builtin_ctz(word);
#endif
    }
    SHARED int lowest_bit(unsigned long long word) {
#if defined(__CUDA_ARCH__)
        return __ffsll((long long)word) - 1;
#else
        return __builtin_ctzll(word);
#endif
    }
    // Whether at most two bits are set.
    SHARED bool has_few(int word) {
        word &= word - 1;
        return !(word & (word - 1));
    }

    SHARED Four four(float x) { return Four{x, x, x, x}; }
    SHARED Eight eight(float x) { return Eight{x, x, x, x, x, x, x, x}; }
    SHARED Eight load(const float* from) {
        Eight v;
        memcpy(&v, from, sizeof(v));
        return v;
    }
    SHARED void store(float* to, Eight v) { memcpy(to, &v, sizeof(v)); }

    SHARED float lesser(float a, float b) { return a < b ? a : b; }
    SHARED float greater(float a, float b) { return a > b ? a : b; }
    SHARED Four lesser(Four a, Four b) { return chosen(a < b, a, b); }
    SHARED Four greater(Four a, Four b) { return chosen(a > b, a, b); }
    SHARED Eight lesser(Eight a, Eight b) { return chosen(a < b, a, b); }
    SHARED Eight greater(Eight a, Eight b) { return chosen(a > b, a, b); }

    // One bit for each lane.
    SHARED int bits(EightFlags flags) {
#if defined(__AVX2__) && !defined(PLAIN_VECTORS)
        return __builtin_ia32_movmskps256((Eight)flags);
#elif defined(PLAIN_VECTORS)
        int word = 0;
        for (int i = 0; i < 8; ++i) word |= (flags.x[i] & 1) << i;
        return word;
#else
        int word = 0;
        for (int i = 0; i < 8; ++i) word |= (flags[i] & 1) << i;
        return word;
#endif
    }

    // The largest of eight.
    SHARED float most(Eight v) {
#if defined(PLAIN_VECTORS)
        for (int i = 1; i < 8; ++i) v[0] = greater(v[i], v[0]);
#else
        v = greater(v, __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3));
        v = greater(v, __builtin_shufflevector(v, v, 2, 3, 0, 1, 6, 7, 4, 5));
        v = greater(v, __builtin_shufflevector(v, v, 1, 0, 3, 2, 5, 4, 7, 6));
#endif
        return v[0];
    }

    // a * b - c * d in three roundings. When the products change places, only its sign changes; it is 0 or has the right
    // sign.
    SHARED Eight difference_of_products(Eight a, Eight b, Eight c, Eight d) {
        UNFUSED
#if defined(__CUDA_ARCH__)
        Eight made;
        for (int i = 0; i < 8; ++i) made.x[i] = __fsub_rn(__fmul_rn(a.x[i], b.x[i]), __fmul_rn(c.x[i], d.x[i]));
        return made;
#else
        const Eight ab = a * b, cd = c * d;
        return ab - cd;
#endif
    }
};
