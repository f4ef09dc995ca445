// Kernels with known answers, and with planted faults.

extern "C" __global__ void reduce_tiles(double* out, const float* rows) {
    const float4 half = load(rows, tile_row(blockIdx.x), half_row());
    const double sum = tile_sum(widen(half)), largest = tile_max(widen(half));
    if (threadIdx.x < LANES) {
        out[(2 * blockIdx.x) * LANES + threadIdx.x] = sum;
        out[(2 * blockIdx.x + 1) * LANES + threadIdx.x] = largest;
    }
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
