// The levels of a batch of systems: rows by colour, blocks of 2^DIM voxels, and their graphs.
//
// Made once a batch, one thread a node, row or coarse row; nothing is added up by atomics, and threads that
// write the same word write the same value, so levels do not depend on the order of threads. A position is
// the flat C-order index of a voxel, or block, in the grid of its system; -1 marks padding rows.
//
// Rows of a colour go brick by brick (cubes of `brick` voxels a side), in C order within a brick. A tile is then
// compact, and its rows share their neighbours: in a solid ball of 2.1 million voxels a tile gathers 2.1 other rows
// for each of its own, where C order throughout would take 3.9 (a disk: 1.3 and 2.9), all from the level-2 cache.
//
// Bytes moved for DIM = 3, what is filled before included: per cell of the grid 6; per node of the finest level
// 9 for marks, 32 for rows, 100 for neighbours and 72 for values; then per row of each level 9 for marks, 28 for
// joins and 84 for the coarser graph (60 on the finest, which has no weights), per cell of the grid of blocks 6,
// per coarse row 96. That is about 360 bytes a node of a shape that fills half of its grid, once.

#include "common.cuh"

#define FACES (2 * DIM)
#define CORNERS (1 << DIM)

__device__ inline void unravel(long long position, const int* side, int* index) {
    for (int axis = DIM - 1; axis >= 0; --axis) {
        index[axis] = (int)(position % side[axis]);
        position /= side[axis];
    }
}

// The block of a voxel, in its place; returns which corner of it the voxel is.
__device__ inline int halve(int* index) {
    int corner = 0;
    for (int axis = 0; axis < DIM; ++axis) {
        corner = 2 * corner + (index[axis] & 1);
        index[axis] /= 2;
    }
    return corner;
}

// Cells stand for voxels in the order of rows: red ones of a system, then black ones, each brick by brick, where
// colours take turns on the last axis. `half` says that sides are those of the grid that blocks of it make up.
__device__ inline long long cell_of(const int* index, const int* side, int half, const long long* first_cell,
                                    int brick) {
    long long bricks = 0;
    int colour = 0, inside = 0, volume = 1;
    for (int axis = 0; axis < DIM; ++axis) {
        const int width = half ? (side[axis] + 1) / 2 : side[axis];
        bricks = bricks * ((width + brick - 1) / brick) + index[axis] / brick;
        inside = inside * brick + index[axis] % brick;
        volume *= brick;
        colour ^= index[axis] & 1;
    }
    return first_cell[colour] + (bricks * volume + inside) / 2;
}

// The system that a node of the concatenated systems belongs to.
__device__ inline int system_of(long long node, const long long* first_node, int n_systems) {
    int low = 0, high = n_systems;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (first_node[middle] <= node)
            low = middle;
        else
            high = middle;
    }
    return low;
}

// Mark the cells of nodes: reads voxels (8 bytes a node), writes marks (1).
extern "C" __global__ void mark_nodes(const long long* voxels, const long long* first_node, const int* grid,
                                      const long long* first_cell, int brick, int n_systems, long long n_nodes,
                                      signed char* marks) {
    const long long node = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (node >= n_nodes)
        return;
    const int system = system_of(node, first_node, n_systems);
    int index[DIM];
    unravel(voxels[node], grid + DIM * system, index);
    marks[cell_of(index, grid + DIM * system, 0, first_cell + 2 * system, brick)] = 1;
}

// The row of each node, from the marked cells up to its own, and its voxel at that row: reads voxels and
// n_marked (12 bytes a node), writes rows and position (12).
extern "C" __global__ void number_nodes(const long long* voxels, const long long* first_node, const int* grid,
                                        const long long* first_cell, int brick, const int* n_marked,
                                        const long long* base, int n_systems, long long n_nodes, int* rows,
                                        long long* position) {
    const long long node = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (node >= n_nodes)
        return;
    const int system = system_of(node, first_node, n_systems);
    const long long* cells = first_cell + 2 * system;
    int index[DIM];
    unravel(voxels[node], grid + DIM * system, index);
    const long long cell = cell_of(index, grid + DIM * system, 0, cells, brick);
    const long long row = base[2 * system + (cell >= cells[1])] + n_marked[cell];
    rows[node] = (int)row;
    position[row] = voxels[node];
}

// Neighbour table by rows, one thread an entry: reads found and a row number (4 + 4 bytes an entry) and the
// row of the node, writes neighbours (4).
extern "C" __global__ void place_neighbours(const int* found, const int* rows, const long long* first_node,
                                            int n_systems, long long n_nodes, int dummy, int* neighbours) {
    const long long entry = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (entry >= n_nodes * FACES)
        return;
    const long long node = entry / FACES;
    const int system = system_of(node, first_node, n_systems);
    const long long other = first_node[system] + found[entry];
    neighbours[(long long)rows[node] * FACES + entry % FACES] =
        other < first_node[system + 1] ? rows[other] : dummy;
}

// Values of nodes by rows, in double and single precision: reads 12 bytes a node, writes 12.
extern "C" __global__ void place_values(const double* values, const int* rows, long long n_nodes,
                                        double* exact, float* rounded) {
    const long long node = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (node >= n_nodes)
        return;
    exact[rows[node]] = values[node];
    rounded[rows[node]] = (float)values[node];
}

// Mark the cells of blocks that hold a row: reads position (8 bytes a row), writes marks (1). A system
// without cells is not coarsened any more.
extern "C" __global__ void mark_blocks(const long long* position, const int* tile_system, const int* grid,
                                       const long long* first_cell, int brick, long long n_rows,
                                       signed char* marks) {
    const long long row = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (row >= n_rows || position[row] < 0)
        return;
    const int system = tile_system[row / TILE];
    const int* side = grid + DIM * system;
    const long long* cells = first_cell + 2 * system;
    if (cells[0] == cells[2])
        return;
    int index[DIM];
    unravel(position[row], side, index);
    halve(index);
    marks[cell_of(index, side, 1, cells, brick)] = 1;
}

// Join rows to their blocks: reads position and n_marked (12 bytes a row), writes parent, children and the
// position of the parent (16); rows with no block get the dummy row as their parent.
extern "C" __global__ void join_blocks(const long long* position, const int* tile_system, const int* grid,
                                       const long long* first_cell, int brick, const int* n_marked,
                                       const long long* base, long long n_rows, int dummy, int* parent,
                                       int* children, long long* parent_position) {
    const long long row = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (row >= n_rows)
        return;
    const int system = tile_system[row / TILE];
    const int* side = grid + DIM * system;
    const long long* cells = first_cell + 2 * system;
    parent[row] = dummy;
    if (position[row] < 0 || cells[0] == cells[2])
        return;
    int index[DIM];
    unravel(position[row], side, index);
    const int corner = halve(index);
    const long long cell = cell_of(index, side, 1, cells, brick);
    const long long above = base[2 * system + (cell >= cells[1])] + n_marked[cell];
    parent[row] = (int)above;
    children[above * CORNERS + corner] = (int)row;
    long long block = 0;
    for (int axis = 0; axis < DIM; ++axis)
        block = block * ((side[axis] + 1) / 2) + index[axis];
    parent_position[above] = block;
}

// The Galerkin graph of unsmoothed aggregation with the Laplacian halved, for piecewise constants overestimate
// the stiffness by two a level, the mass not at all. One thread a coarse row, over its children in C order:
// reads each child's number, graph and the parents of its neighbours (12 + 24 DIM bytes, on the finest level 8 DIM
// fewer), writes the coarse graph (8 + 16 DIM).
extern "C" __global__ void coarsen(const int* children, const int* parent, const int* neighbours,
                                   const float* weight, const float* diagonal, const float* mass,
                                   const int* tile_system, int fine, int n_rows, int n_coarse, int* table,
                                   float* coarse_weight, float* coarse_diagonal, float* coarse_mass) {
    const long long here = (long long)blockIdx.x * THREADS + threadIdx.x;
    if (here >= n_coarse)
        return;
    int joined[FACES];
    float sum[FACES], loop = 0.0f, total = 0.0f;
    int empty = 1;
#pragma unroll
    for (int k = 0; k < FACES; ++k) {
        joined[k] = n_coarse;
        sum[k] = 0.0f;
    }
    for (int corner = 0; corner < CORNERS; ++corner) {
        const long long row = children[here * CORNERS + corner];
        if (row == n_rows)
            continue;
        const float* weights = weight + (fine ? tile_system[row / TILE] : row) * FACES;
        empty = 0;
        loop += 0.5f * diagonal[row];
        total += mass[row];
#pragma unroll
        for (int k = 0; k < FACES; ++k) {
            const int other = neighbours[row * FACES + k];
            if (other == n_rows)
                continue;
            const float half = 0.5f * weights[k];
            if (parent[other] == here) {
                loop -= half;
            } else {
                joined[k] = parent[other];
                sum[k] += half;
            }
        }
    }
#pragma unroll
    for (int k = 0; k < FACES; ++k) {
        table[here * FACES + k] = joined[k];
        coarse_weight[here * FACES + k] = sum[k];
    }
    coarse_diagonal[here] = empty ? 1.0f : loop;
    coarse_mass[here] = total;
}
