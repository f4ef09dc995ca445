// Kernels with known answers, and with planted faults.

extern "C" __global__ void reduce_tiles(double* out, const float* rows) {
    const float4 half = load(rows, tile_row(blockIdx.x), half_row());
    const double sum = tile_sum(widen(half)), largest = tile_max(widen(half));
    if (threadIdx.x < LANES) {
        out[(2 * blockIdx.x) * LANES + threadIdx.x] = sum;
        out[(2 * blockIdx.x + 1) * LANES + threadIdx.x] = largest;
    }
}

// Sum of one number of each thread of the block, returned by thread 0; all threads call it.
__device__ inline double block_sum(double value) {
    __shared__ double scratch[THREADS / 32];
    for (int step = 16; step > 0; step /= 2) value += __shfl_xor_sync(0xffffffffu, value, step);
    if (threadIdx.x % 32 == 0) scratch[threadIdx.x / 32] = value;
    __syncthreads();
    double result = 0;
    if (threadIdx.x == 0)
        for (int i = 0; i < THREADS / 32; i++) result += scratch[i];
    __syncthreads();
    return result;
}

extern "C" __global__ void sum_block(double* out) {
    const double sum = block_sum(threadIdx.x);
    if (threadIdx.x == 0) out[blockIdx.x] = sum;
}

extern "C" __global__ void count_threads(int* out) { atomicAdd(out, 1); }

// A race unless barrier is set.
extern "C" __global__ void reverse(int* out, int barrier) {
    __shared__ int held[THREADS];
    held[threadIdx.x] = threadIdx.x;
    if (barrier) __syncthreads();
    out[threadIdx.x] = held[THREADS - 1 - threadIdx.x];
}

extern "C" __global__ void halve(float* v) { v[threadIdx.x] *= 0.5f; }

// Halves behind a barrier, where threads are fibers.
extern "C" __global__ void halve_later(float* v) {
    __syncthreads();
    v[threadIdx.x] *= 0.5f;
}

extern "C" __global__ void last_block(int* out) { *out = blockIdx.x; }

extern "C" __global__ void stale_shared(float* out) {
    __shared__ float held;
    if (threadIdx.x == 0) {
        out[blockIdx.x] = held;
        held = 1;
    }
}

extern "C" __global__ void early_return(float* v) {
    if (threadIdx.x > 200) return;
    __syncthreads();
    v[threadIdx.x] = 1;
}

extern "C" __global__ void two_barriers(float* v) {
    if (threadIdx.x < 100)
        __syncthreads();
    else
        __syncthreads();
    v[threadIdx.x] = 1;
}

extern "C" __global__ void shifted(float* v, int shift) { v[(int)threadIdx.x + shift] = 1; }

extern "C" __global__ void shifted_read(float* v, const float* w, int shift) {
    v[threadIdx.x] = w[(int)threadIdx.x + shift];
}

extern "C" __global__ void through_table(float* const* table) { table[0][threadIdx.x] = 1; }

extern "C" __global__ void warp_words(int* out) {
    const unsigned all = 0xffffffffu;
    const int thread = threadIdx.x, lane = thread % 32;
    int* mine = out + 8 * thread;
    mine[0] = __shfl_sync(all, thread, 3);
    mine[1] = __shfl_xor_sync(all, thread, 5);
    mine[2] = __shfl_up_sync(all, thread, 2);
    mine[3] = __shfl_down_sync(all, thread, 2, 8);
    mine[4] = (int)__ballot_sync(all, lane % 3 == 0);
    mine[5] = __any_sync(all, thread == 40);
    mine[6] = __all_sync(all, thread != 40);
    __shared__ int next[THREADS];
    next[thread] = thread;
    __syncwarp();
    mine[7] = next[thread ^ 1];
}

extern "C" __global__ void half_warp(int* out) {
    if (threadIdx.x < 16) out[threadIdx.x] = __shfl_xor_sync(0x0000ffffu, (int)threadIdx.x, 1);
}

extern "C" __global__ void misaligned(float* v) {
    if (threadIdx.x == 0) *reinterpret_cast<float4*>(v + 1) = make_float4(1, 2, 3, 4);
}
