// What all kernels share: the tile, arithmetic on half rows, and sums over a tile in one fixed order.
//
// A row has LANES floats, one sector of 32 bytes. A block of THREADS threads works on a tile of TILE rows: thread t
// has the half row t % 2 of row t / 2, one float4, so that every access is 16 bytes wide and coalesced.

#define THREADS 256
#define TILE 128
#define LANES 8

// Four numbers in double precision, one for each lane of a half row.
struct Quad {
    double x, y, z, w;
};

__device__ inline float4 operator+(float4 a, float4 b) {
    return make_float4(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w);
}

__device__ inline float4 operator-(float4 a, float4 b) {
    return make_float4(a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w);
}

__device__ inline float4 operator*(float4 a, float4 b) {
    return make_float4(a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w);
}

__device__ inline float4 splat(float a) { return make_float4(a, a, a, a); }

// a * b + c
__device__ inline float4 fma4(float a, float4 b, float4 c) {
    return make_float4(fmaf(a, b.x, c.x), fmaf(a, b.y, c.y), fmaf(a, b.z, c.z), fmaf(a, b.w, c.w));
}

__device__ inline float4 fma4(float4 a, float4 b, float4 c) {
    return make_float4(fmaf(a.x, b.x, c.x), fmaf(a.y, b.y, c.y), fmaf(a.z, b.z, c.z), fmaf(a.w, b.w, c.w));
}

__device__ inline Quad operator+(Quad a, Quad b) { return {a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w}; }

__device__ inline Quad operator-(Quad a, Quad b) { return {a.x - b.x, a.y - b.y, a.z - b.z, a.w - b.w}; }

__device__ inline Quad operator*(double a, Quad b) { return {a * b.x, a * b.y, a * b.z, a * b.w}; }

__device__ inline Quad operator*(Quad a, Quad b) { return {a.x * b.x, a.y * b.y, a.z * b.z, a.w * b.w}; }

__device__ inline Quad widen(float4 a) { return {a.x, a.y, a.z, a.w}; }

__device__ inline float4 narrow(Quad a) { return make_float4((float)a.x, (float)a.y, (float)a.z, (float)a.w); }

// a * b + c, the product of two floats being exact in double precision
__device__ inline Quad fma4(float4 a, float4 b, Quad c) {
    return {fma((double)a.x, (double)b.x, c.x), fma((double)a.y, (double)b.y, c.y),
            fma((double)a.z, (double)b.z, c.z), fma((double)a.w, (double)b.w, c.w)};
}

__device__ inline Quad fma4(double a, Quad b, Quad c) {
    return {fma(a, b.x, c.x), fma(a, b.y, c.y), fma(a, b.z, c.z), fma(a, b.w, c.w)};
}

// Row and half row of this thread in a tile.
__device__ inline int tile_row(int tile) { return tile * TILE + (int)threadIdx.x / 2; }

__device__ inline int half_row() { return (int)threadIdx.x % 2; }

// A half row of a vector: sixteen bytes at (row, 4 * half).
__device__ inline float4 load(const float* vector, int row, int half) {
    return reinterpret_cast<const float4*>(vector)[2ll * row + half];
}

__device__ inline void store(float* vector, int row, int half, float4 value) {
    reinterpret_cast<float4*>(vector)[2ll * row + half] = value;
}

struct Sum {
    __device__ double operator()(double a, double b) const { return a + b; }
};

struct Largest {
    __device__ double operator()(double a, double b) const { return fmax(a, b); }
};

// Combine the half rows of all threads lane by lane; all threads call it, threads 0..7 return the LANES results.
// A warp halves what each of its threads carries before it halves the threads (5 shuffles in place of 16), then
// the warps' results meet in shared memory; the second barrier lets scratch be used again at once.
template <typename Join>
__device__ double tile_join(Quad value, Join join) {
    __shared__ double scratch[THREADS / 32][LANES];
    const unsigned all = 0xffffffffu;
    const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
    const bool high = lane & 16, odd = lane & 8;
    double keep = high ? value.z : value.x, keep2 = high ? value.w : value.y;
    const double give = high ? value.x : value.z, give2 = high ? value.y : value.w;
    keep = join(keep, __shfl_xor_sync(all, give, 16));
    keep2 = join(keep2, __shfl_xor_sync(all, give2, 16));
    double part = join(odd ? keep2 : keep, __shfl_xor_sync(all, odd ? keep : keep2, 8));
    part = join(part, __shfl_xor_sync(all, part, 4));
    part = join(part, __shfl_xor_sync(all, part, 2));
    if ((lane & 6) == 0) scratch[warp][4 * (lane & 1) + 2 * high + odd] = part;
    __syncthreads();
    double result = 0;
    if (threadIdx.x < LANES) {
        result = scratch[0][threadIdx.x];
        for (int i = 1; i < THREADS / 32; i++) result = join(result, scratch[i][threadIdx.x]);
    }
    __syncthreads();
    return result;
}

// Sums over the rows of a tile (or over all that its threads have summed), one a lane, in threads 0..7.
__device__ inline double tile_sum(Quad value) { return tile_join(value, Sum()); }

// Largest over the rows of a tile, one a lane, in threads 0..7.
__device__ inline double tile_max(Quad value) { return tile_join(value, Largest()); }
