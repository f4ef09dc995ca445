// CUDA's vector types, arithmetic and atomics, which are plain C++ where one thread runs at a time.
#pragma once
#include <math.h>
#include <string.h>

namespace {

template <typename T>
struct alignas(2 * sizeof(T)) Vector2 {
    T x, y;
};
template <typename T>
struct Vector3 {
    T x, y, z;
};
template <typename T>
struct alignas(16) Vector4 {
    T x, y, z, w;
};
using float2 = Vector2<float>;
using float3 = Vector3<float>;
using float4 = Vector4<float>;
using double2 = Vector2<double>;
using int2 = Vector2<int>;
using int3 = Vector3<int>;
using int4 = Vector4<int>;
using uint2 = Vector2<unsigned>;
using uint4 = Vector4<unsigned>;
inline float2 make_float2(float x, float y) { return {x, y}; }
inline float3 make_float3(float x, float y, float z) { return {x, y, z}; }
inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }
inline double2 make_double2(double x, double y) { return {x, y}; }
inline int2 make_int2(int x, int y) { return {x, y}; }
inline int3 make_int3(int x, int y, int z) { return {x, y, z}; }
inline int4 make_int4(int x, int y, int z, int w) { return {x, y, z, w}; }

#define SIMULATOR_EXTREMES(T)                         \
    inline T min(T a, T b) { return b < a ? b : a; } \
    inline T max(T a, T b) { return a < b ? b : a; }
SIMULATOR_EXTREMES(int)
SIMULATOR_EXTREMES(unsigned)
SIMULATOR_EXTREMES(long)
SIMULATOR_EXTREMES(unsigned long)
SIMULATOR_EXTREMES(long long)
SIMULATOR_EXTREMES(unsigned long long)
inline float min(float a, float b) { return fminf(a, b); }
inline float max(float a, float b) { return fmaxf(a, b); }
inline double min(double a, double b) { return fmin(a, b); }
inline double max(double a, double b) { return fmax(a, b); }
inline float rsqrtf(float a) { return 1.0f / sqrtf(a); }
inline double rsqrt(double a) { return 1.0 / sqrt(a); }
inline float __fdividef(float a, float b) { return a / b; }
inline float __frcp_rn(float a) { return 1.0f / a; }
inline float __fmul_rn(float a, float b) { return a * b; }
inline float __fadd_rn(float a, float b) { return a + b; }
inline float __fmaf_rn(float a, float b, float c) { return fmaf(a, b, c); }
inline double __dmul_rn(double a, double b) { return a * b; }
inline double __dadd_rn(double a, double b) { return a + b; }
inline double __fma_rn(double a, double b, double c) { return fma(a, b, c); }
inline int __popc(unsigned a) { return __builtin_popcount(a); }
inline int __popcll(unsigned long long a) { return __builtin_popcountll(a); }
inline int __ffs(int a) { return __builtin_ffs(a); }
inline int __clz(int a) { return a ? __builtin_clz((unsigned)a) : 32; }

template <typename To, typename From>
inline To same_bits(From from) {
    static_assert(sizeof(To) == sizeof(From));
    To to;
    memcpy(&to, &from, sizeof to);
    return to;
}
inline int __float_as_int(float a) { return same_bits<int>(a); }
inline unsigned __float_as_uint(float a) { return same_bits<unsigned>(a); }
inline float __int_as_float(int a) { return same_bits<float>(a); }
inline float __uint_as_float(unsigned a) { return same_bits<float>(a); }
inline long long __double_as_longlong(double a) { return same_bits<long long>(a); }
inline double __longlong_as_double(long long a) { return same_bits<double>(a); }

template <typename T>
inline T __ldg(const T* place) { return *place; }
template <typename T>
inline T __ldcg(const T* place) { return *place; }
template <typename T>
inline T __ldcs(const T* place) { return *place; }
template <typename T>
inline void __stcs(T* place, T value) { *place = value; }
template <typename T>
inline void __stcg(T* place, T value) { *place = value; }
inline void __threadfence() {}
inline void __threadfence_block() {}

// The value before, as CUDA's atomics return it.
template <typename T>
inline T exchange(T* place, T value) {
    const T before = *place;
    *place = value;
    return before;
}
template <typename T, typename U>
inline T atomicAdd(T* place, U value) { return exchange(place, (T)(*place + (T)value)); }
template <typename T, typename U>
inline T atomicSub(T* place, U value) { return exchange(place, (T)(*place - (T)value)); }
template <typename T, typename U>
inline T atomicMin(T* place, U value) { return exchange(place, (T)value < *place ? (T)value : *place); }
template <typename T, typename U>
inline T atomicMax(T* place, U value) { return exchange(place, *place < (T)value ? (T)value : *place); }
template <typename T, typename U>
inline T atomicOr(T* place, U value) { return exchange(place, (T)(*place | (T)value)); }
template <typename T, typename U>
inline T atomicAnd(T* place, U value) { return exchange(place, (T)(*place & (T)value)); }
template <typename T, typename U>
inline T atomicExch(T* place, U value) { return exchange(place, (T)value); }
template <typename T, typename U, typename V>
inline T atomicCAS(T* place, U expected, V value) {
    return exchange(place, *place == (T)expected ? (T)value : *place);
}

}  // namespace
