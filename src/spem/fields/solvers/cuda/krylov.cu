// Block conjugate gradients on the finest level: what lies between two cycles.
//
// A block of threads holds a tile of 128 rows, two threads a row of four lanes; alpha and beta have a row of
// lanes for each system. x is a step late: the pass that turns p reads p anyhow, and takes x along it first.
// Bytes are told per row, 32 being the lanes of one vector.

#include "common.cuh"

#define FACES (2 * DIM)

// Start afresh, x = 0 and p = z: reads z, writes x and p (96 bytes).
extern "C" __global__ void search_start(const int *tiles, const float *z, float *x, float *p) {
    const int row = tile_row(tiles[blockIdx.x]), half = half_row();
    store(x, row, half, splat(0.0f));
    store(p, row, half, load(z, row, half));
}

// Advance x by its last step, x += alpha p, and turn p = z + beta p: reads x, z and p, writes x and p (160).
extern "C" __global__ void search_turn(const int *tiles, const int *tile_system, const float *alpha,
                                       const float *beta, const float *z, float *x, float *p) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const float4 old = load(p, row, half);
    store(x, row, half, fma4(load(alpha, system, half), old, load(x, row, half)));
    store(p, row, half, fma4(load(beta, system, half), old, load(z, row, half)));
}

// Advance x by its last step, x += alpha p: reads x and p, writes x (96).
extern "C" __global__ void search_finish(const int *tiles, const int *tile_system, const float *alpha,
                                         const float *p, float *x) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    store(x, row, half, fma4(load(alpha, system, half), load(p, row, half), load(x, row, half)));
}

// Multiply q = (A + s M) p, and p q of each tile: reads p, neighbours, diagonal and mass, writes q
// (72 + 8 DIM). Turning p here as well would read it once less, but gather z and p of all neighbours.
extern "C" __global__ void search_multiply(const int *tiles, const int *tile_system, const int *neighbours,
                                           const float *weight, const float *diagonal, const float *mass,
                                           const float *shift, const float *p, float *q, double *partial) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const int2 *rows = reinterpret_cast<const int2 *>(neighbours + row * FACES);
    const float4 here = load(p, row, half);
    const float m = mass[row];
    float4 value = fma4(m, load(shift, system, half), splat(diagonal[row])) * here;
#pragma unroll
    for (int axis = 0; axis < DIM; ++axis) {
        const int2 pair = rows[axis];
        value = fma4(-weight[system * FACES + 2 * axis], load(p, pair.x, half), value);
        value = fma4(-weight[system * FACES + 2 * axis + 1], load(p, pair.y, half), value);
    }
    store(q, row, half, value);
    const double sum = tile_sum(fma4(here, value, Quad{0.0, 0.0, 0.0, 0.0}));
    if (threadIdx.x < LANES)
        partial[(long long)tile * LANES + threadIdx.x] = sum;
}

// Advance the residual, r -= alpha q: reads r and q, writes r (96).
extern "C" __global__ void improve_residual(const int *tiles, const int *tile_system, const float *alpha,
                                            const float *q, float *r) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const float4 step = splat(0.0f) - load(alpha, system, half);
    store(r, row, half, fma4(step, load(q, row, half), load(r, row, half)));
}

// Largest magnitude of z in each tile: reads z (32).
extern "C" __global__ void peak(const int *tiles, const float *z, double *partial) {
    const int tile = tiles[blockIdx.x];
    const float4 value = load(z, tile_row(tile), half_row());
    const float4 size = make_float4(fabsf(value.x), fabsf(value.y), fabsf(value.z), fabsf(value.w));
    const double largest = tile_max(widen(size));
    if (threadIdx.x < LANES)
        partial[(long long)tile * LANES + threadIdx.x] = largest;
}

// The numbers of a run of tiles joined in an order that depends on its length alone; one block a run.
template <typename Join>
__device__ void join_tiles(const int *runs, const double *partial, double *total, Join join) {
    __shared__ double scratch[THREADS];
    const int first = runs[2 * blockIdx.x], end = runs[2 * blockIdx.x + 1], thread = threadIdx.x;
    double value = 0.0;
    for (long long at = (long long)first * LANES + thread; at < (long long)end * LANES; at += THREADS)
        value = join(value, partial[at]);
    scratch[thread] = value;
    for (int step = THREADS / 2; step >= LANES; step /= 2) {
        __syncthreads();
        if (thread < step)
            scratch[thread] = join(scratch[thread], scratch[thread + step]);
    }
    if (thread < LANES)
        total[blockIdx.x * LANES + thread] = scratch[thread];
}

// Sums over runs of tiles: reads 64 bytes a tile.
extern "C" __global__ void sum_tiles(const int *runs, const double *partial, double *total) {
    join_tiles(runs, partial, total, Sum());
}

// Largest numbers of runs of tiles, all of them positive or zero: reads 64 bytes a tile.
extern "C" __global__ void max_tiles(const int *runs, const double *partial, double *total) {
    join_tiles(runs, partial, total, Largest());
}
