// One symmetric V-cycle with red-black Gauss-Seidel: down red then black from zero, up black then red.
//
// A block of threads holds a tile of 128 rows of one system and one colour, two threads a row of four lanes.
// Edges join red and black only. So on the way down red values are r / d, which nobody has to write; what is
// left of the residual sits on red rows, and is the sum of w z over black neighbours; on the way up only what
// red values change by, the coarse answers of their blocks, reaches the black ones. A pass reads its own rows
// once from memory; rows of neighbours, of which a tile has about twice its own, come mostly from cache.
//
// The bytes that passes move are told per row of a level: 32 are the lanes of a vector, 8 DIM the neighbours
// (on coarse levels 16 DIM, with their weights). Rows times 2 DIM or 2^DIM have to be below 2^31.

#include "common.cuh"

#define FACES (2 * DIM)
#define CORNERS (1 << DIM)
#define COARSEST 48  // nodes of the level that is inverted

// Within two roundings; what is a little off does no harm here as long as it is so in every pass.
__device__ inline float reciprocal(float value) {
#ifdef __CUDA_ARCH__
    return __fdividef(1.0f, value);
#else
    return 1.0f / value;
#endif
}

// A level as the passes on one system see it; the rows of weights are `step` numbers apart.
struct Graph {
    const int *neighbours;
    const float *weight;
    const float *diagonal;
    const float *mass;
    int step;
    int n_rows;
};

// What kernels that do several levels know of one: `Cycle` packs it.
struct Table {
    const int *neighbours;
    const float *weight;
    const float *diagonal;
    const float *mass;
    const int *parent;
    const int *children;  // of the rows of the next level
    float *r;
    float *z;
    long long n_rows;
    long long n_coarse;
};

__device__ inline Graph graph_of(const int *neighbours, const float *weight, const float *diagonal,
                                 const float *mass, int n_rows, int fine, int system) {
    return {neighbours, fine ? weight + system * FACES : weight, diagonal, mass, fine ? 0 : FACES, n_rows};
}

__device__ inline Graph graph_of(const Table &table, int level, int system) {
    return graph_of(table.neighbours, table.weight, table.diagonal, table.mass, (int)table.n_rows, level == 0,
                    system);
}

// Reciprocals of the diagonal of a row, by lane.
__device__ inline float4 inverse_diagonal(const Graph &graph, int row, float4 shift) {
    const float d = graph.diagonal[row], m = graph.mass[row];
    return make_float4(reciprocal(fmaf(shift.x, m, d)), reciprocal(fmaf(shift.y, m, d)),
                       reciprocal(fmaf(shift.z, m, d)), reciprocal(fmaf(shift.w, m, d)));
}

// Neighbours of a row and the weights of the edges to them, eight bytes at a time.
struct Star {
    int row[FACES];
    float weight[FACES];
};

__device__ inline Star star_of(const Graph &graph, int row) {
    Star star;
    const int2 *rows = (const int2 *)(graph.neighbours + row * FACES);
    const float2 *weights = (const float2 *)(graph.weight + row * graph.step);
#pragma unroll
    for (int axis = 0; axis < DIM; ++axis) {
        const int2 pair = rows[axis];
        const float2 weight = weights[axis];
        star.row[2 * axis] = pair.x;
        star.row[2 * axis + 1] = pair.y;
        star.weight[2 * axis] = weight.x;
        star.weight[2 * axis + 1] = weight.y;
    }
    return star;
}

// Sum of w z over the neighbours of a row.
__device__ inline float4 inflow(const Graph &graph, int row, int half, const float *z) {
    const Star star = star_of(graph, row);
    float4 sum = splat(0.0f);
#pragma unroll
    for (int k = 0; k < FACES; ++k)
        sum = fma4(star.weight[k], load(z, star.row[k], half), sum);
    return sum;
}

// Black on the way down: z = (r + sum of w r / d over red neighbours) / d.
__device__ inline void relax_down(const Graph &graph, int row, int half, float4 shift, const float *r,
                                  float *z) {
    const Star star = star_of(graph, row);
    float4 sum = load(r, row, half);
#pragma unroll
    for (int k = 0; k < FACES; ++k) {
        // The dummy row has no diagonal, but it has r = 0.
        const float4 inverse = inverse_diagonal(graph, min(star.row[k], graph.n_rows - 1), shift);
        sum = fma4(star.weight[k], load(r, star.row[k], half) * inverse, sum);
    }
    store(z, row, half, sum * inverse_diagonal(graph, row, shift));
}

// Residual of a block: that of its red children, at the corners an even number of steps from the first.
__device__ inline void gather_residual(const Graph &fine, const int *children, int row, int half,
                                       const float *z, float *coarse) {
    float4 sum = splat(0.0f);
#pragma unroll
    for (int corner = 0; corner < CORNERS; ++corner) {
        int odd = 0;
#pragma unroll
        for (int axis = 0; axis < DIM; ++axis)
            odd ^= corner >> axis & 1;
        if (odd)
            continue;
        const int child = children[row * CORNERS + corner];
        if (child < fine.n_rows)
            sum = sum + inflow(fine, child, half, z);
    }
    store(coarse, row, half, sum);
}

// Black on the way up: z += (sum of w e over the blocks of red neighbours) / d; returns z.
__device__ inline float4 relax_black(const Graph &graph, const int *parent, int n_coarse, int row, int half,
                                     float4 shift, const float *coarse, float *z) {
    const Star star = star_of(graph, row);
    float4 sum = splat(0.0f);
#pragma unroll
    for (int k = 0; k < FACES; ++k) {
        const int above = star.row[k] < graph.n_rows ? parent[star.row[k]] : n_coarse;
        sum = fma4(star.weight[k], load(coarse, above, half), sum);
    }
    const float4 value = fma4(sum, inverse_diagonal(graph, row, shift), load(z, row, half));
    store(z, row, half, value);
    return value;
}

// Red on the way up: z = (r + sum of w z over black neighbours) / d; returns z.
__device__ inline float4 relax_red(const Graph &graph, int row, int half, float4 shift, float4 residual,
                                   float *z) {
    const float4 value = (residual + inflow(graph, row, half, z)) * inverse_diagonal(graph, row, shift);
    store(z, row, half, value);
    return value;
}

// Products of the half rows of a tile, summed by lane; all threads call it.
__device__ inline void write_product(float4 a, float4 b, int tile, double *partial) {
    const double sum = tile_sum(fma4(a, b, Quad{0.0, 0.0, 0.0, 0.0}));
    if (threadIdx.x < LANES)
        partial[(long long)tile * LANES + threadIdx.x] = sum;
}

// Black tiles on the way down. Reads r, diagonal and mass (40 bytes a row), and neighbours of black rows
// (4 DIM), writes z of black rows (16).
extern "C" __global__ void cycle_down(const int *tiles, const int *tile_system, const int *neighbours,
                                      const float *weight, const float *diagonal, const float *mass,
                                      int n_rows, int fine, const float *shift, const float *r, float *z) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const Graph graph = graph_of(neighbours, weight, diagonal, mass, n_rows, fine, system);
    relax_down(graph, row, half, load(shift, system, half), r, z);
}

// Tiles of both colours of the coarser level. Reads z of black rows (16 bytes), neighbours of red rows
// (4 DIM) and children (4), writes r of the coarser level (32 / 2^DIM).
extern "C" __global__ void cycle_restrict(const int *tiles, const int *tile_system, const int *children,
                                          const int *neighbours, const float *weight, int n_rows, int fine,
                                          const float *z, float *coarse) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const Graph graph = graph_of(neighbours, weight, nullptr, nullptr, n_rows, fine, system);
    gather_residual(graph, children, row, half, z, coarse);
}

// Black tiles on the way up, and on the finest level their r z. Reads z of the coarser level (32 / 2^DIM
// bytes), parents of red rows (2), and of black rows z, diagonal, mass and neighbours (20 + 4 DIM) and on the
// finest level r (16), writes their z (16).
extern "C" __global__ void cycle_black(const int *tiles, const int *tile_system, const int *neighbours,
                                       const float *weight, const float *diagonal, const float *mass,
                                       int n_rows, int fine, const float *shift, const int *parent,
                                       int n_coarse, const float *coarse, const float *r, float *z,
                                       double *partial) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const Graph graph = graph_of(neighbours, weight, diagonal, mass, n_rows, fine, system);
    const float4 lanes = load(shift, system, half);
    const float4 value = relax_black(graph, parent, n_coarse, row, half, lanes, coarse, z);
    if (fine)
        write_product(load(r, row, half), value, tile, partial);
}

// Red tiles on the way up, and on the finest level their r z. Reads z of black rows (16 bytes), and of red
// rows r, diagonal, mass and neighbours (20 + 4 DIM), writes their z (16).
extern "C" __global__ void cycle_red(const int *tiles, const int *tile_system, const int *neighbours,
                                     const float *weight, const float *diagonal, const float *mass,
                                     int n_rows, int fine, const float *shift, const float *r, float *z,
                                     double *partial) {
    const int tile = tiles[blockIdx.x], system = tile_system[tile];
    const int row = tile_row(tile), half = half_row();
    const Graph graph = graph_of(neighbours, weight, diagonal, mass, n_rows, fine, system);
    const float4 residual = load(r, row, half);
    const float4 value = relax_red(graph, row, half, load(shift, system, half), residual, z);
    if (fine)
        write_product(residual, value, tile, partial);
}

// Entry (i, j) of the inverse of a system's coarsest matrix, by lane; i runs fastest, so that threads of rows
// side by side read sectors side by side.
__device__ inline long long inverse_entry(int system, int i, int j) {
    return (((long long)system * COARSEST + j) * COARSEST + i) * LANES;
}

// Where a system lies on a level.
struct Range {
    int first, middle, end;  // tiles: red, then black
    int n_red, n_black;
};

// Row of a node of a system's coarsest level; each colour stands at the start of its tiles.
__device__ inline int node_row(const Range &range, int node) {
    return node < range.n_red ? range.first * TILE + node : range.middle * TILE + node - range.n_red;
}

__device__ inline int row_node(const Range &range, int row) {
    return row < range.middle * TILE ? row - range.first * TILE : range.n_red + row - range.middle * TILE;
}

// Invert a system's coarsest matrix for one lane, by Gauss and Jordan in double precision; an M-matrix needs
// no search for pivots. One block a lane of a system. Reads the coarsest graph, writes at most 9 kB.
extern "C" __global__ void cycle_invert(const int *systems, const long long *levels, const int *ranges,
                                        int n_systems, const int *depth, const float *shift, float *inverse) {
    __shared__ double matrix[COARSEST][COARSEST], column[COARSEST], line[COARSEST];
    const int system = systems[blockIdx.x / LANES], lane = blockIdx.x % LANES, level = depth[system];
    const Table table = ((const Table *)levels)[level];
    const Range range = ((const Range *)ranges)[level * n_systems + system];
    const Graph graph = graph_of(table, level, system);
    const int n = range.n_red + range.n_black, thread = threadIdx.x;
    for (int entry = thread; entry < n * n; entry += THREADS)
        matrix[entry / n][entry % n] = 0.0;
    __syncthreads();
    if (thread < n) {
        const int row = node_row(range, thread);
        const double s = shift[system * LANES + lane];
        matrix[thread][thread] = graph.diagonal[row] + s * graph.mass[row];
        const Star star = star_of(graph, row);
        for (int k = 0; k < FACES; ++k)
            if (star.row[k] < graph.n_rows)
                matrix[thread][row_node(range, star.row[k])] -= star.weight[k];
    }
    __syncthreads();
    for (int pivot = 0; pivot < n; ++pivot) {
        if (thread < n) {
            column[thread] = matrix[thread][pivot];
            line[thread] = matrix[pivot][thread];
        }
        __syncthreads();
        const double scale = 1.0 / column[pivot];
        for (int entry = thread; entry < n * n; entry += THREADS) {
            const int i = entry / n, j = entry % n;
            const double left = i == pivot ? -1.0 : column[i], right = j == pivot ? 1.0 : line[j];
            const double old = i == pivot || j == pivot ? 0.0 : matrix[i][j];
            matrix[i][j] = old - left * right * scale;
        }
        __syncthreads();
    }
    for (int entry = thread; entry < n * n; entry += THREADS)
        inverse[inverse_entry(system, entry / n, entry % n) + lane] = (float)matrix[entry / n][entry % n];
}

// The coarsest answer of a system, z = inverse r; one block, at most 2 COARSEST threads of which work.
__device__ inline void solve_coarsest(const Range &range, int system, const float *inverse, const float *r,
                                      float *z) {
    const int n = range.n_red + range.n_black, node = tile_row(0), half = half_row();
    if (node >= n)
        return;
    float4 sum = splat(0.0f);
    for (int j = 0; j < n; ++j) {
        const float4 entry = load(inverse + inverse_entry(system, node, j), 0, half);
        sum = fma4(entry, load(r, node_row(range, j), half), sum);
    }
    store(z, node_row(range, node), half, sum);
}

// All of a cycle below the levels that have kernels of their own: one block a system goes from its entry
// level to its coarsest, solves, and comes back. Levels are small, and their vectors stay in cache.
extern "C" __global__ void __launch_bounds__(THREADS, 4)
    cycle_tail(const int *systems, const long long *levels, const int *ranges, int n_systems, const int *entry,
               const int *depth, const float *shift, const float *inverse, const float *r, float *z,
               double *partial) {
    const int system = systems[blockIdx.x], row = tile_row(0), half = half_row();
    const int top = entry[system], bottom = depth[system];
    const float4 lanes = load(shift, system, half);
    const Range *own = (const Range *)ranges + system;
    const Table *tables = (const Table *)levels;
    for (int level = top; level < bottom; ++level) {
        const Table &table = tables[level];
        const Graph graph = graph_of(table, level, system);
        const Range fine = own[level * n_systems], coarse = own[(level + 1) * n_systems];
        float *values = level == 0 ? z : table.z;
        for (int tile = fine.middle; tile < fine.end; ++tile)
            relax_down(graph, tile * TILE + row, half, lanes, level == 0 ? r : table.r, values);
        __syncthreads();
        for (int tile = coarse.first; tile < coarse.end; ++tile)
            gather_residual(graph, table.children, tile * TILE + row, half, values, tables[level + 1].r);
        __syncthreads();
    }
    const float *last = bottom == 0 ? r : tables[bottom].r;
    solve_coarsest(own[bottom * n_systems], system, inverse, last, bottom == 0 ? z : tables[bottom].z);
    __syncthreads();
    for (int level = bottom - 1; level >= top; --level) {
        const Table &table = tables[level];
        const Graph graph = graph_of(table, level, system);
        const Range range = own[level * n_systems];
        const float *residual = level == 0 ? r : table.r;
        float *values = level == 0 ? z : table.z;
        for (int tile = range.middle; tile < range.end; ++tile)
            relax_black(graph, table.parent, (int)table.n_coarse, tile * TILE + row, half, lanes,
                        tables[level + 1].z, values);
        __syncthreads();
        for (int tile = range.first; tile < range.middle; ++tile)
            relax_red(graph, tile * TILE + row, half, lanes, load(residual, tile * TILE + row, half), values);
        __syncthreads();
    }
    if (top == 0)
        for (int tile = own->first; tile < own->end; ++tile)
            write_product(load(r, tile * TILE + row, half), load(z, tile * TILE + row, half), tile, partial);
}
