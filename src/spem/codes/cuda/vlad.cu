// Codes of a batch of shapes: from maps to sums of differences, for each word of each level (5.1, 5.2).
//
// Maps are rows of N_MAPS floats, at most THREADS; a tile of TILE rows belongs to one shape, and a chunk to
// a number of whole tiles of one shape, counted from its first. Sums run over the rows of a chunk, then over the
// chunks of a shape, each in an order that depends on the shape alone. Rows that are not kept count nowhere.
// There are N_CENTERS words, and N_CUTS + 1 levels; a bin is a word of a level, a slot a map of a bin.

#include "common.cuh"

#define BINS ((N_CUTS + 1) * N_CENTERS)
#define SLOTS (BINS * N_MAPS)
#define SLOT_BLOCKS ((SLOTS + THREADS - 1) / THREADS)
// Rows that a block reads at a time, one thread a number.
#define STRIDE (THREADS / N_MAPS)

// Join what the threads of each map have found, in the order of the threads; threads below N_MAPS return it.
template <typename Join>
__device__ double join_columns(double value, Join join)
{
    __shared__ double shared[THREADS];
    shared[threadIdx.x] = value;
    __syncthreads();
    double result = value;
    if (threadIdx.x < N_MAPS)
        for (int i = 1; i < STRIDE; ++i)
            result = join(result, shared[i * N_MAPS + threadIdx.x]);
    return result;
}

// Join the rows first .. last of a table of N_MAPS columns, in threads below N_MAPS.
template <typename Join>
__device__ double join_rows(const double *table, int first, int last, Join join)
{
    const int column = threadIdx.x % N_MAPS, offset = threadIdx.x / N_MAPS;
    double value = 0;
    if (offset < STRIDE)
        for (int row = first + offset; row < last; row += STRIDE)
            value = join(value, table[(long long)row * N_MAPS + column]);
    return join_columns(value, join);
}

// Largest magnitude of each map over a chunk: reads 4 N_MAPS + 1 bytes a row.
extern "C" __global__ void chunk_peaks(const float *maps, const unsigned char *kept, const int *first_row,
                                       double *partial)
{
    const int column = threadIdx.x % N_MAPS, offset = threadIdx.x / N_MAPS;
    const int last = first_row[blockIdx.x + 1];
    float peak = 0;
    if (offset < STRIDE)
        for (int row = first_row[blockIdx.x] + offset; row < last; row += STRIDE)
            if (kept[row])
                peak = fmaxf(peak, fabsf(maps[(long long)row * N_MAPS + column]));
    const double joined = join_columns(peak, Largest());
    if (threadIdx.x < N_MAPS)
        partial[(long long)blockIdx.x * N_MAPS + threadIdx.x] = joined;
}

// Largest magnitude of each map of a shape, one block a shape: reads 8 N_MAPS bytes a chunk.
extern "C" __global__ void shape_peaks(const double *partial, const int *first_chunk, float *peak)
{
    const double joined = join_rows(partial, first_chunk[blockIdx.x], first_chunk[blockIdx.x + 1], Largest());
    if (threadIdx.x < N_MAPS)
        peak[blockIdx.x * N_MAPS + threadIdx.x] = (float)joined;
}

// Sum of squares of each map over a chunk, in units of its peak: reads 4 N_MAPS + 1 bytes a row.
extern "C" __global__ void chunk_squares(const float *maps, const unsigned char *kept, const int *first_row,
                                         const int *tile_shape, const float *peak, double *partial)
{
    const int column = threadIdx.x % N_MAPS, offset = threadIdx.x / N_MAPS;
    const int first = first_row[blockIdx.x], last = first_row[blockIdx.x + 1];
    const float largest = peak[tile_shape[first / TILE] * N_MAPS + column];
    const float unit = largest > 0 ? largest : 1.0f;
    double sum = 0;
    if (offset < STRIDE)
        for (int row = first + offset; row < last; row += STRIDE)
            if (kept[row]) {
                const double value = maps[(long long)row * N_MAPS + column] / unit;
                sum += value * value;
            }
    const double joined = join_columns(sum, Sum());
    if (threadIdx.x < N_MAPS)
        partial[(long long)blockIdx.x * N_MAPS + threadIdx.x] = joined;
}

// Root mean square of each map of a shape, in units of its peak: reads 8 N_MAPS bytes a chunk.
extern "C" __global__ void shape_rms(const double *partial, const int *first_chunk, const int *n_kept, float *rms)
{
    const double joined = join_rows(partial, first_chunk[blockIdx.x], first_chunk[blockIdx.x + 1], Sum());
    if (threadIdx.x < N_MAPS)
        rms[blockIdx.x * N_MAPS + threadIdx.x] = (float)sqrt(joined / n_kept[blockIdx.x]);
}

// Turn the maps of each row into node features, in place, and find its bin, -1 for a row that is not kept; one
// thread a row: reads 4 N_MAPS + 1 bytes a row, writes 4 N_MAPS + 4.
extern "C" __global__ void find_words(float *maps, const unsigned char *kept, int n_rows, const int *tile_shape,
                                      const float *peak, const float *rms, const float *mean,
                                      const float *transform, const float *centers, const double *cuts, int *bin)
{
    const int row = blockIdx.x * THREADS + threadIdx.x;
    if (row >= n_rows)
        return;
    if (!kept[row]) {
        bin[row] = -1;
        return;
    }
    float *values = maps + (long long)row * N_MAPS;
    const int shape = tile_shape[row / TILE] * N_MAPS;
    float unit[N_MAPS], feature[N_MAPS];
    int level = 0;
    const double highest = peak[shape], share = highest > 0 ? values[0] / highest : values[0];
    for (int i = 0; i < N_CUTS; ++i)
        level += cuts[i] < share;
    for (int i = 0; i < N_MAPS; ++i) {
        const float largest = peak[shape + i], root = rms[shape + i];
        unit[i] = values[i] / (largest > 0 ? largest : 1.0f) / (root > 0 ? root : 1.0f) - mean[i];
        feature[i] = 0;
    }
    for (int i = 0; i < N_MAPS; ++i)
        for (int j = 0; j < N_MAPS; ++j)
            feature[j] = fmaf(unit[i], transform[i * N_MAPS + j], feature[j]);
    int nearest = 0;
    float least = 0;
    for (int word = 0; word < N_CENTERS; ++word) {
        float distance = 0;
        for (int i = 0; i < N_MAPS; ++i) {
            const float difference = feature[i] - centers[word * N_MAPS + i];
            distance = fmaf(difference, difference, distance);
        }
        if (word == 0 || distance < least) {
            least = distance;
            nearest = word;
        }
    }
    for (int i = 0; i < N_MAPS; ++i)
        values[i] = feature[i];
    bin[row] = level * N_CENTERS + nearest;
}

// Number of rows of each bin in a chunk, sums of their differences from the word and of the squares, one thread
// a slot: reads 4 SLOT_BLOCKS + 4 N_MAPS bytes a row, writes 16 SLOTS + 4 BINS a chunk.
extern "C" __global__ void chunk_sums(const float *features, const int *bin, const int *first_row,
                                      const float *centers, int *counts, double *sums)
{
    __shared__ int found[THREADS];
    const int chunk = blockIdx.x / SLOT_BLOCKS, slot = blockIdx.x % SLOT_BLOCKS * THREADS + threadIdx.x;
    const int mine = slot / N_MAPS, column = slot % N_MAPS, last = first_row[chunk + 1];
    const double center = slot < SLOTS ? centers[mine % N_CENTERS * N_MAPS + column] : 0.0f;
    int count = 0;
    double sum = 0, squares = 0;
    for (int first = first_row[chunk]; first < last; first += THREADS) {
        const int row = first + threadIdx.x;
        __syncthreads();
        found[threadIdx.x] = row < last ? bin[row] : -1;
        __syncthreads();
        for (int i = 0; i < THREADS; ++i)
            if (found[i] == mine) {
                const double difference = features[(long long)(first + i) * N_MAPS + column] - center;
                ++count;
                sum += difference;
                squares += difference * difference;
            }
    }
    if (slot >= SLOTS)
        return;
    if (column == 0)
        counts[(long long)chunk * BINS + mine] = count;
    sums[2ll * chunk * SLOTS + slot] = sum;
    sums[(2ll * chunk + 1) * SLOTS + slot] = squares;
}

// The same of a whole shape, one thread a slot: reads 16 SLOTS + 4 BINS bytes a chunk.
extern "C" __global__ void shape_sums(const int *counts, const double *sums, const int *first_chunk,
                                      int *shape_counts, double *shape_sums)
{
    const int shape = blockIdx.x / SLOT_BLOCKS, slot = blockIdx.x % SLOT_BLOCKS * THREADS + threadIdx.x;
    if (slot >= SLOTS)
        return;
    int count = 0;
    double sum = 0, squares = 0;
    for (int chunk = first_chunk[shape]; chunk < first_chunk[shape + 1]; ++chunk) {
        sum += sums[2ll * chunk * SLOTS + slot];
        squares += sums[(2ll * chunk + 1) * SLOTS + slot];
        if (slot % N_MAPS == 0)
            count += counts[(long long)chunk * BINS + slot / N_MAPS];
    }
    if (slot % N_MAPS == 0)
        shape_counts[shape * BINS + slot / N_MAPS] = count;
    shape_sums[2ll * shape * SLOTS + slot] = sum;
    shape_sums[(2ll * shape + 1) * SLOTS + slot] = squares;
}
