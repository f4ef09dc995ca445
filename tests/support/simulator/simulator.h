// A CPU that runs CUDA kernels of one-dimensional grids and static shared memory, one thread at a time.
//
// Every thread of a block runs on a fiber until a barrier or a shuffle stops it; a fiber that meets none takes the
// next thread, so kernels without barriers never switch. Between barriers, threads run forward, backward or
// shuffled, and so do blocks: a kernel whose result depends on it has a race. Shared memory is poisoned before each
// block. Threads that wait for others that have returned, or that wait elsewhere, are an error.
#pragma once
#include <math.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <tuple>
#include <ucontext.h>
#include <utility>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

// A change of stack. Where the compiler has its own, they are faster, and the address sanitizer's longjmp, which
// knows of one stack only, has no part in it; nor may it mark frames that are never left.
#if defined(__x86_64__)
#define SIMULATOR_SAVE(state) __builtin_setjmp((void**)(state))
#define SIMULATOR_RESUME(state) __builtin_longjmp((void**)(state), 1)
#else
#define SIMULATOR_SAVE(state) _setjmp(state)
#define SIMULATOR_RESUME(state) _longjmp(state, 1)
#endif
#define SIMULATOR_SWITCH __attribute__((noinline, no_sanitize("address")))

#define __global__
#define __device__
#define __host__
#define __forceinline__ inline
#define __noinline__ __attribute__((noinline))
#define __launch_bounds__(...)
#define __shared__ static __attribute__((section("cuda_shared")))
#define __constant__ static
#define __align__(n) __attribute__((aligned(n)))
#define __syncthreads() simulator::barrier(-1, __FILE__, __LINE__)
#define __syncwarp(...) simulator::barrier((int)threadIdx.x / 32, __FILE__, __LINE__)
#define __shfl_sync(mask, value, ...) simulator::shuffle(simulator::at, mask, value, __FILE__, __LINE__, __VA_ARGS__)
#define __shfl_xor_sync(mask, value, ...) \
    simulator::shuffle(simulator::flip, mask, value, __FILE__, __LINE__, __VA_ARGS__)
#define __shfl_down_sync(mask, value, ...) \
    simulator::shuffle(simulator::down, mask, value, __FILE__, __LINE__, __VA_ARGS__)
#define __shfl_up_sync(mask, value, ...) simulator::shuffle(simulator::up, mask, value, __FILE__, __LINE__, __VA_ARGS__)
#define __ballot_sync(mask, test) simulator::ballot(mask, test, __FILE__, __LINE__)
#define __any_sync(mask, test) (simulator::ballot(mask, test, __FILE__, __LINE__) != 0)
#define __all_sync(mask, test) (simulator::ballot(mask, test, __FILE__, __LINE__) == 0xffffffffu)

extern char __start_cuda_shared[] __attribute__((weak));
extern char __stop_cuda_shared[] __attribute__((weak));

namespace {

struct dim3 {
    unsigned x, y, z;
};
dim3 threadIdx{0, 0, 0}, blockIdx{0, 0, 0}, blockDim{1, 1, 1}, gridDim{1, 1, 1};
constexpr int warpSize = 32;

}  // namespace

#include "words.h"

namespace simulator {
namespace {

constexpr int threads = 256, warps = threads / 32;
constexpr size_t stack_bytes = 256 << 10;

struct Fiber {
    jmp_buf state;
    ucontext_t start;
    bool started = false;
    char* stack = nullptr;
};

struct Place {
    const char* file;
    int line;
};

void (*body)(void**);
void** body_arguments;
Fiber fibers[threads];
jmp_buf home;
Fiber* idle[threads];
Fiber* owner[threads];  // of each thread that waits or runs
int idle_count, ready[threads * 2], ready_first, ready_count, next, done, current;
int turn[threads];                    // the order of threads
int waiting_block, waiting_warp[warps];
Place where_block, where_warp[warps], waits[threads];
bool waits_here[threads], mixed, refused;
int mode;
unsigned long long random_state;
alignas(16) char slots[2][threads][16];
unsigned char parity[threads];
char message[512];

unsigned draw(unsigned below) {
    random_state = random_state * 6364136223846793005ull + 1442695040888963407ull;
    return (unsigned)((random_state >> 33) % below);
}

// The numbers 0 .. n - 1 as the mode has them.
void arrange(int* list, int n) {
    for (int i = 0; i < n; i++) list[i] = mode == 1 ? n - 1 - i : i;
    if (mode == 2)
        for (int i = n - 1; i > 0; i--) std::swap(list[i], list[draw(i + 1)]);
}

void leave(Fiber* fiber);

// Life of a fiber: it runs threads that have not begun, and when there are none, waits idle.
SIMULATOR_SWITCH void work() {
    for (;;) {
        threadIdx.x = (unsigned)current;
        body(body_arguments);
        done++;
        Fiber* const fiber = owner[current];
        owner[current] = nullptr;
        if (ready_count == 0 && next < threads) {
            current = turn[next++];
            owner[current] = fiber;
            continue;
        }
        idle[idle_count++] = fiber;
        leave(fiber);
    }
}

[[noreturn]] SIMULATOR_SWITCH void enter(Fiber* fiber) {
    if (fiber == nullptr) SIMULATOR_RESUME(home);
    if (fiber->started) SIMULATOR_RESUME(fiber->state);
    fiber->started = true;
    setcontext(&fiber->start);
    abort();
}

// The fiber to run next: of a thread that is ready, or an idle one with a thread that has not begun; null if none.
Fiber* choose() {
    if (ready_count) {
        current = ready[ready_first];
        ready_first = (ready_first + 1) % (2 * threads);
        ready_count--;
        return owner[current];
    }
    if (next < threads) {
        current = turn[next++];
        return owner[current] = idle[--idle_count];
    }
    return nullptr;
}

SIMULATOR_SWITCH void leave(Fiber* fiber) {
    Fiber* const chosen = choose();
    if (chosen == fiber) return;
    if (SIMULATOR_SAVE(fiber->state) == 0) enter(chosen);
}

void wake(int first, int count) {
    int list[threads];
    arrange(list, count);
    for (int i = 0; i < count; i++) {
        ready[(ready_first + ready_count++) % (2 * threads)] = first + list[i];
        waits_here[first + list[i]] = false;
    }
}

// Wait for the other threads of a warp, or of the block (warp -1).
SIMULATOR_SWITCH void barrier(int warp, const char* file, int line) {
    const int thread = current;
    int& waiting = warp < 0 ? waiting_block : waiting_warp[warp];
    Place& where = warp < 0 ? where_block : where_warp[warp];
    const int count = warp < 0 ? threads : 32;
    if (waiting == 0) where = {file, line};
    mixed |= where.line != line || strcmp(where.file, file) != 0;
    waits[thread] = {file, line};
    waits_here[thread] = true;
    if (mixed) enter(nullptr);
    if (++waiting == count) {
        waiting = 0;
        wake(warp < 0 ? 0 : 32 * warp, count);
    }
    leave(owner[thread]);
    threadIdx.x = (unsigned)thread;
}

enum Move { at, flip, down, up };

// What another lane of the warp passes; two sets of slots, so that one barrier is enough.
template <typename T>
T shuffle(Move move, unsigned mask, T value, const char* file, int line, int by, int width = 32) {
    static_assert(sizeof(T) <= 16);
    if (mask != 0xffffffffu) {
        snprintf(message, sizeof message, "%s:%d: a shuffle of a part of a warp is not simulated", file, line);
        refused = true;
        enter(nullptr);
    }
    const int thread = current, lane = thread % 32, base = lane / width * width;
    char(*slot)[16] = slots[parity[thread] ^= 1];
    memcpy(slot[thread], &value, sizeof value);
    barrier(thread / 32, file, line);
    int from = move == at ? base + by % width : move == flip ? lane ^ by : move == down ? lane + by : lane - by;
    if (from < base || from >= base + width) from = lane;
    memcpy(&value, slot[thread - lane + from], sizeof value);
    return value;
}

inline unsigned ballot(unsigned mask, bool test, const char* file, int line) {
    unsigned votes = (unsigned)test << (current % 32);
    for (int step = 1; step < 32; step *= 2) votes |= shuffle(flip, mask, votes, file, line, step);
    return votes;
}

void prepare_fibers() {
    for (Fiber& fiber : fibers) {
        if (!fiber.stack) {
            const int flags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
            fiber.stack = (char*)mmap(nullptr, stack_bytes, PROT_READ | PROT_WRITE, flags, -1, 0);
            if (fiber.stack == (char*)MAP_FAILED) abort();
        }
        getcontext(&fiber.start);
        fiber.start.uc_stack.ss_sp = fiber.stack;
        // Tops of stacks are staggered, or all of them would share a few sets of the cache.
        fiber.start.uc_stack.ss_size = stack_bytes - 192 * (size_t)(&fiber - fibers);
        fiber.start.uc_link = nullptr;
        makecontext(&fiber.start, work, 0);
        fiber.started = false;
    }
    idle_count = 0;
    for (int i = threads - 1; i >= 0; i--) idle[idle_count++] = &fibers[i];
}

void tell(const char* name) {
    int thread = 0;
    while (thread < threads - 1 && !waits_here[thread]) thread++;
    snprintf(message, sizeof message,
             mixed ? "kernel %s, block %u: threads of one block wait at different barriers, thread %d at %s:%d"
                   : "kernel %s, block %u: threads wait for others that never come, thread %d at %s:%d",
             name, blockIdx.x, thread, waits[thread].file, waits[thread].line);
}

// Run one block; false when its threads could not all come to their end.
SIMULATOR_SWITCH bool run_block(const char* name) {
    if (__start_cuda_shared) memset(__start_cuda_shared, 0xff, (size_t)(__stop_cuda_shared - __start_cuda_shared));
    arrange(turn, threads);
    next = done = ready_count = ready_first = waiting_block = 0;
    memset(waiting_warp, 0, sizeof waiting_warp);
    mixed = false;
    refused = false;
    if (SIMULATOR_SAVE(home) == 0) enter(choose());
    if (done == threads) return true;
    if (!refused) tell(name);
    memset(waits_here, 0, sizeof waits_here);
    prepare_fibers();
    return false;
}

// Denormal numbers are zero while one lives, as in kernels that CuPy compiles (-ftz=true, for floats alone there).
struct Flush {
#if defined(__SSE2__)
    const unsigned before = _mm_getcsr();
    Flush() { _mm_setcsr(before | 0x8040); }
    ~Flush() { _mm_setcsr(before); }
#endif
};

// Run a grid; null, or what went wrong.
const char* run(const char* name, void (*call)(void**), void** arguments, int n_blocks, int order, unsigned seed) {
    const Flush flush;  // before fibers are made, which start with what holds then
    static bool prepared = (prepare_fibers(), true);
    (void)prepared;
    (void)flush;
    body = call;
    body_arguments = arguments;
    mode = order;
    random_state = seed;
    blockDim.x = threads;
    gridDim.x = (unsigned)n_blocks;
    int* const blocks = (int*)malloc(sizeof(int) * (size_t)n_blocks);
    arrange(blocks, n_blocks);
    bool good = true;
    for (int i = 0; i < n_blocks && good; i++) {
        blockIdx.x = (unsigned)blocks[i];
        good = run_block(name);
    }
    free(blocks);
    return good ? nullptr : message;
}

template <auto kernel, typename... P, size_t... I>
void unpack(void (*)(P...), void** arguments, std::index_sequence<I...>) {
    kernel(*static_cast<P*>(arguments[I])...);
    (void)arguments;
}

template <auto kernel, typename... P>
void call_with(void** arguments, void (*type)(P...)) {
    unpack<kernel>(type, arguments, std::index_sequence_for<P...>());
}

template <auto kernel>
void call(void** arguments) {
    call_with<kernel>(arguments, kernel);
}

}  // namespace
}  // namespace simulator
