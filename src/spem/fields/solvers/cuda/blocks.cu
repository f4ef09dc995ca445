// The reduced basis on the device: predictions, their true residuals, products of columns, projections.
//
// Columns stand in blocks of LANES, Real[n_rows + 1][LANES]; `blocks` holds the addresses of n_blocks of them, so
// the basis has K = n_blocks * LANES columns. All arithmetic is in double precision, whatever columns are stored
// in. DIM is the dimension of the shapes, and WIDE is 1 where columns are in double precision.

#include "common.cuh"

#if WIDE
using Real = double;
#else
using Real = float;
#endif

#define SQUARE (LANES * LANES)
// Blocks whose coefficients are in shared memory at a time.
#define STAGED 8
// Blocks whose products with a chunk of rows are in registers at a time: one product of each, or three.
#define GROUP(products) ((products) == 1 ? 4 : 2 - WIDE)

// Half rows of vectors of either precision.
__device__ inline Quad read(const float* vector, size_t row, int half) {
    return widen(reinterpret_cast<const float4*>(vector)[2 * row + half]);
}

__device__ inline Quad read(const double* vector, size_t row, int half) {
    const double2* pair = reinterpret_cast<const double2*>(vector) + 4 * row + 2 * half;
    const double2 low = pair[0], high = pair[1];
    return {low.x, low.y, high.x, high.y};
}

__device__ inline void write(float* vector, size_t row, int half, Quad value) {
    reinterpret_cast<float4*>(vector)[2 * row + half] = narrow(value);
}

__device__ inline void write(double* vector, size_t row, int half, Quad value) {
    double2* pair = reinterpret_cast<double2*>(vector) + 4 * row + 2 * half;
    pair[0] = make_double2(value.x, value.y);
    pair[1] = make_double2(value.z, value.w);
}

// Half row of sum + block * mix, for one row of a block and its eight rows of coefficients.
template <class T>
__device__ inline Quad mix_row(const T* block, size_t row, const double* mix, int half, Quad sum) {
    const Quad low = read(block, row, 0), high = read(block, row, 1);
    const double values[LANES] = {low.x, low.y, low.z, low.w, high.x, high.y, high.z, high.w};
#pragma unroll
    for (int i = 0; i < LANES; i++) sum = fma4(values[i], read(mix, i, half), sum);
    return sum;
}

// Half row of sum + B * columns first, ..., first + LANES - 1 of mix, double[K][width]. All threads call it.
__device__ inline Quad mix_basis(const Real* const* blocks, int n_blocks, const double* mix, int width, int first,
                                 double* staged, size_t row, int half, Quad sum) {
    for (int start = 0; start < n_blocks; start += STAGED) {
        const int count = min(STAGED, n_blocks - start);
        __syncthreads();
        for (int e = threadIdx.x; e < count * SQUARE; e += THREADS) {
            const int column = first + e % LANES;
            staged[e] = column < width ? mix[(start * LANES + e / LANES) * width + column] : 0.0;
        }
        __syncthreads();
        for (int k = 0; k < count; k++) sum = mix_row(blocks[start + k], row, staged + k * SQUARE, half, sum);
    }
    return sum;
}

// Half row of A v, from that of v; the two edges along an axis have the same weight. Neighbours are read along AXES
// axes at a time.
template <int AXES, class T>
__device__ inline Quad multiply(const int* neighbours, const double* weights, double diagonal, const T* v,
                                size_t row, int half, Quad here) {
    const int2* pair = reinterpret_cast<const int2*>(neighbours) + row * DIM;
    Quad value = diagonal * here;
#pragma unroll AXES
    for (int axis = 0; axis < DIM; axis++) {
        const int2 next = pair[axis];
        value = fma4(-weights[2 * axis], read(v, next.x, half) + read(v, next.y, half), value);
    }
    return value;
}

// u = B mix, with mix double[K][LANES] of each system; the dummy row of u is set to zero.
// Bytes a row: LANES * sizeof(Real) for each block, and 64 of u.
extern "C" __global__ void __launch_bounds__(THREADS)
    predict(const int* tiles, const int* tile_system, const Real* const* blocks, int n_blocks, const double* mix,
            int n_rows, double* u) {
    alignas(16) __shared__ double staged[STAGED * SQUARE];
    const int tile = tiles[blockIdx.x], row = tile_row(tile), half = half_row();
    const double* own = mix + static_cast<size_t>(tile_system[tile]) * n_blocks * SQUARE;
    write(u, row, half, mix_basis(blocks, n_blocks, own, LANES, 0, staged, row, half, {0.0, 0.0, 0.0, 0.0}));
    if (blockIdx.x == 0 && threadIdx.x < 2) write(u, n_rows, half, {0.0, 0.0, 0.0, 0.0});
}

// block = x mix + B remove, with mix double[LANES][LANES] and remove double[K][LANES] of each system.
// Bytes a row: 32 of x, and LANES * sizeof(Real) for each block and for the new one.
extern "C" __global__ void __launch_bounds__(THREADS)
    make_block(const int* tiles, const int* tile_system, const float* x, const double* mix,
               const Real* const* blocks, int n_blocks, const double* remove, Real* block) {
    alignas(16) __shared__ double staged[STAGED * SQUARE];
    const int tile = tiles[blockIdx.x], row = tile_row(tile), half = half_row();
    const size_t system = tile_system[tile];
    for (int e = threadIdx.x; e < SQUARE; e += THREADS) staged[e] = mix[system * SQUARE + e];
    __syncthreads();
    const Quad sum = mix_row(x, row, staged, half, {0.0, 0.0, 0.0, 0.0});
    const double* own = remove + system * n_blocks * SQUARE;
    write(block, row, half, mix_basis(blocks, n_blocks, own, LANES, 0, staged, row, half, sum));
}

// Rows of constant + B mix, of width columns, for one tile; row i is written as row place[i], unless that is
// negative, or where it stands if there is no place.
template <class T>
__device__ inline void project_tile(int tile, size_t system, const Real* const* blocks, int n_blocks,
                                    const double* constant, const double* mix, int width, const int* place,
                                    double* staged, T* out) {
    const int row = tile_row(tile), half = half_row();
    constant += system * width;
    mix += system * n_blocks * LANES * width;
    for (int first = 0; first < width; first += LANES) {
        const Quad sum = mix_basis(blocks, n_blocks, mix, width, first, staged, row, half, {0.0, 0.0, 0.0, 0.0});
        const int target = place ? place[row] : row;
        if (target < 0) continue;
        const int column = first + 4 * half;
        T* const four = out + static_cast<size_t>(target) * width + column;
        if (width % 4 == 0 && column < width) {
            write(four, 0, 0, sum + read(constant + column, 0, 0));
            continue;
        }
        const double values[4] = {sum.x, sum.y, sum.z, sum.w};
#pragma unroll
        for (int j = 0; j < 4; j++)
            if (column + j < width) four[j] = static_cast<T>(values[j] + constant[column + j]);
    }
}

// out = constant + B mix, with constant double[width] and mix double[K][width] of each system.
// Bytes a row: LANES * sizeof(Real) for each block, from the cache after the first eight columns, 4 of place if
// there is one, and 4 width.
extern "C" __global__ void __launch_bounds__(THREADS)
    project_single(const int* tiles, const int* tile_system, const Real* const* blocks, int n_blocks,
                   const double* constant, const double* mix, int width, const int* place, float* out) {
    alignas(16) __shared__ double staged[STAGED * SQUARE];
    const int tile = tiles[blockIdx.x];
    project_tile(tile, tile_system[tile], blocks, n_blocks, constant, mix, width, place, staged, out);
}

// The same in double precision, 8 width.
extern "C" __global__ void __launch_bounds__(THREADS)
    project_double(const int* tiles, const int* tile_system, const Real* const* blocks, int n_blocks,
                   const double* constant, const double* mix, int width, const int* place, double* out) {
    alignas(16) __shared__ double staged[STAGED * SQUARE];
    const int tile = tiles[blockIdx.x];
    project_tile(tile, tile_system[tile], blocks, n_blocks, constant, mix, width, place, staged, out);
}

// r = s M (1 - u) - A u, with s double[LANES] of each system.
// Bytes a row: 64 of u, 8 DIM of neighbours, 16 of diagonal and mass, and 32 of r.
extern "C" __global__ void __launch_bounds__(THREADS)
    deficit_residual(const int* tiles, const int* tile_system, const int* neighbours, const double* weights,
                     const double* diagonal, const double* mass, const double* shifts, const double* u, float* r) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile], row = tile_row(tile), half = half_row();
    const Quad here = read(u, row, half), one = {1.0, 1.0, 1.0, 1.0};
    const Quad product = multiply<DIM>(neighbours, weights + system * 2 * DIM, diagonal[row], u, row, half, here);
    write(r, row, half, mass[row] * read(shifts, system, half) * (one - here) - product);
}

// v += x.
// Bytes a row: 32 of x, and 64 of v read and written.
extern "C" __global__ void __launch_bounds__(THREADS)
    advance_solution(const int* tiles, const float* x, double* v) {
    const int row = tile_row(tiles[blockIdx.x]), half = half_row();
    write(v, row, half, read(v, row, half) + read(x, row, half));
}

// r = b - (A + s M) v, and r·r of each tile, double[n_tiles][LANES].
// Bytes a row: 64 of v and of b, 8 DIM of neighbours, 16 of diagonal and mass, and 32 of r.
extern "C" __global__ void __launch_bounds__(THREADS)
    source_residual(const int* tiles, const int* tile_system, const int* neighbours, const double* weights,
                    const double* diagonal, const double* mass, const double* shifts, const double* b,
                    const double* v, float* r, double* partial) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile], row = tile_row(tile), half = half_row();
    const Quad here = read(v, row, half);
    const Quad product = multiply<DIM>(neighbours, weights + system * 2 * DIM, diagonal[row], v, row, half, here);
    const Quad value = read(b, row, half) - product - mass[row] * read(shifts, system, half) * here;
    write(r, row, half, value);
    const double square = tile_sum(value * value);
    if (threadIdx.x < LANES) partial[static_cast<size_t>(tile) * LANES + threadIdx.x] = square;
}

// Rows of a tile in shared memory: X, and with three products A X and the diagonal of M, and a block's; widened
// once, as that is slow.
template <int PRODUCTS>
struct Rows {
    alignas(16) double x[TILE * LANES];
    alignas(16) double block[2][TILE * LANES];
    alignas(16) double ax[PRODUCTS == 1 ? 1 : TILE * LANES];
    double mass[PRODUCTS == 1 ? 1 : TILE];
};

// Add the products of columns of a tile with X, A X and M X. Thread t has entry t % SQUARE and every fourth row:
// a warp reads parts of one row at a time, and no bank of shared memory twice.
template <int PRODUCTS>
__device__ inline void cross_tile(const double* columns, const Rows<PRODUCTS>& rows, double (&sum)[PRODUCTS]) {
    const int i = threadIdx.x % SQUARE / LANES, j = threadIdx.x % LANES;
#pragma unroll 2
    for (int row = threadIdx.x / SQUARE; row < TILE; row += THREADS / SQUARE) {
        const double left = columns[row * LANES + i], right = rows.x[row * LANES + j];
        sum[0] = fma(left, right, sum[0]);
        if (PRODUCTS == 3) {
            sum[PRODUCTS / 2] = fma(left, rows.ax[row * LANES + j], sum[PRODUCTS / 2]);
            sum[PRODUCTS - 1] = fma(left, rows.mass[row] * right, sum[PRODUCTS - 1]);
        }
    }
}

// Add the sums of the columns of X and of M X in a tile to sum, double[2][THREADS] in shared memory, where there
// is more room than in registers. Thread t has column t % LANES.
__device__ inline void sum_columns(const Rows<3>& rows, double* sum) {
    const int j = threadIdx.x % LANES;
    double all = 0.0, weighted = 0.0;
    for (int row = threadIdx.x / LANES; row < TILE; row += THREADS / LANES) {
        all += rows.x[row * LANES + j];
        weighted = fma(rows.mass[row], rows.x[row * LANES + j], weighted);
    }
    sum[threadIdx.x] += all;
    sum[THREADS + threadIdx.x] += weighted;
}

// Add up the values of the threads that are equal modulo width, in order, and write the sums.
__device__ inline void join_threads(double value, int width, double* scratch, double* out) {
    scratch[threadIdx.x] = value;
    __syncthreads();
    if (threadIdx.x < width) {
        double sum = 0.0;
        for (int t = threadIdx.x; t < THREADS; t += width) sum += scratch[t];
        out[threadIdx.x] = sum;
    }
    __syncthreads();
}

// A chunk is a run of tiles of one system; of it a block of threads does a group of blocks from the first on, X
// itself being the last.
struct Chunk {
    int first_tile;
    int end_tile;
    const Real* const* blocks;
    int n_blocks;
    int first;
};

__device__ inline Chunk chunk_of(const int* chunks, const int* chunk_tile, const Real* const* blocks, int n_blocks,
                                 int group, int& number) {
    const int groups = n_blocks / group + 1;
    number = chunks[blockIdx.x / groups];
    return {chunk_tile[number], chunk_tile[number + 1], blocks, n_blocks, (int)blockIdx.x % groups * group};
}

// Add the products of the blocks of a group with the tile of X in shared memory.
template <int PRODUCTS>
__device__ inline void cross_group(const Chunk& chunk, int row, int half, Rows<PRODUCTS>& rows,
                                   double (&sum)[GROUP(PRODUCTS)][PRODUCTS]) {
    const int own = threadIdx.x / 2;
#pragma unroll
    for (int k = 0; k < GROUP(PRODUCTS); k++) {
        const int number = chunk.first + k;
        if (number > chunk.n_blocks) break;
        if (number < chunk.n_blocks) write(rows.block[k % 2], own, half, read(chunk.blocks[number], row, half));
        __syncthreads();
        cross_tile(number < chunk.n_blocks ? rows.block[k % 2] : rows.x, rows, sum[k]);
    }
}

// Write the sums of a group to entries [n_blocks + 1][PRODUCTS][LANES][LANES] of a chunk.
template <int PRODUCTS>
__device__ inline void write_group(const Chunk& chunk, const double (&sum)[GROUP(PRODUCTS)][PRODUCTS], double* scratch,
                                   double* entries) {
    __syncthreads();
#pragma unroll
    for (int k = 0; k < GROUP(PRODUCTS); k++) {
        const int number = chunk.first + k;
        if (number > chunk.n_blocks) break;
#pragma unroll
        for (int product = 0; product < PRODUCTS; product++)
            join_threads(sum[k][product], SQUARE, scratch, entries + (number * PRODUCTS + product) * SQUARE);
    }
}

// Products BᵀX and XᵀX of each chunk. Grid: the chunks of the list times the groups of blocks.
// Bytes a row: 32 of X for each group, and LANES * sizeof(Real) for each block.
extern "C" __global__ void __launch_bounds__(THREADS)
    cross(const int* chunks, const int* chunk_tile, const Real* const* blocks, int n_blocks, const float* x,
          double* partial) {
    __shared__ Rows<1> rows;
    __shared__ double scratch[THREADS];
    int number;
    const Chunk chunk = chunk_of(chunks, chunk_tile, blocks, n_blocks, GROUP(1), number);
    const int own = threadIdx.x / 2, half = half_row();
    double sum[GROUP(1)][1] = {};
#pragma unroll 1
    for (int tile = chunk.first_tile; tile < chunk.end_tile; tile++) {
        const int row = tile_row(tile);
        __syncthreads();
        write(rows.x, own, half, read(x, row, half));
        cross_group(chunk, row, half, rows, sum);
    }
    write_group(chunk, sum, scratch, partial + static_cast<size_t>(number) * (n_blocks + 1) * SQUARE);
}

// Products BᵀC, BᵀAC and BᵀMC of each chunk, C itself last, then 1ᵀC and 1ᵀMC. Grid as for cross.
// Bytes a row: LANES * sizeof(Real) of C, 8 DIM of neighbours, 16 of diagonal and mass for each group, and
// LANES * sizeof(Real) for each block.
extern "C" __global__ void __launch_bounds__(THREADS, 4)
    cross_operator(const int* chunks, const int* chunk_tile, const int* tile_system, const Real* const* blocks,
                   int n_blocks, const Real* c, const int* neighbours, const double* weights,
                   const double* diagonal, const double* mass, double* partial) {
    __shared__ Rows<3> rows;
    __shared__ double scratch[THREADS], column_sum[2 * THREADS];
    int number;
    const Chunk chunk = chunk_of(chunks, chunk_tile, blocks, n_blocks, GROUP(3), number);
    const int own = threadIdx.x / 2, half = half_row();
    const bool last = chunk.first + GROUP(3) > n_blocks;
    weights += tile_system[chunk.first_tile] * 2 * DIM;
    double sum[GROUP(3)][3] = {};
    column_sum[threadIdx.x] = column_sum[THREADS + threadIdx.x] = 0.0;
#pragma unroll 1
    for (int tile = chunk.first_tile; tile < chunk.end_tile; tile++) {
        const int row = tile_row(tile);
        const Quad here = read(c, row, half);
        // one axis at a time, or registers run out
        const Quad product = multiply<1>(neighbours, weights, diagonal[row], c, row, half, here);
        __syncthreads();
        write(rows.x, own, half, here);
        write(rows.ax, own, half, product);
        if (half == 0) rows.mass[own] = mass[row];
        cross_group(chunk, row, half, rows, sum);
        if (last) sum_columns(rows, column_sum);
    }
    double* entries = partial + static_cast<size_t>(number) * ((n_blocks + 1) * 3 * SQUARE + 2 * LANES);
    write_group(chunk, sum, scratch, entries);
    if (!last) return;
    entries += (n_blocks + 1) * 3 * SQUARE;
    join_threads(column_sum[threadIdx.x], LANES, scratch, entries);
    join_threads(column_sum[THREADS + threadIdx.x], LANES, scratch, entries + LANES);
}

// Sums of the rows of partial, double[..][n_entries], over each run of the list; run k is of the rows from first[k]
// up to first[k + 1]. Eight threads share the rows of an entry, each in order, and their sums are added in order.
extern "C" __global__ void __launch_bounds__(THREADS)
    sum_runs(const int* runs, const int* first, const double* partial, int n_entries, double* out) {
    __shared__ double scratch[THREADS];
    const int width = THREADS / 8, groups = (n_entries + width - 1) / width;
    const int run = runs[blockIdx.x / groups];
    const int entry = (int)blockIdx.x % groups * width + (int)threadIdx.x % width;
    double sum = 0.0;
    if (entry < n_entries)
        for (int row = first[run] + threadIdx.x / width; row < first[run + 1]; row += 8)
            sum += partial[static_cast<size_t>(row) * n_entries + entry];
    scratch[threadIdx.x] = sum;
    __syncthreads();
    if (threadIdx.x >= width || entry >= n_entries) return;
    sum = 0.0;
    for (int t = threadIdx.x; t < THREADS; t += width) sum += scratch[t];
    out[static_cast<size_t>(run) * n_entries + entry] = sum;
}
