// Three-vectors and 3 x 3 matrices of SIMD vectors, with the operations that element kernels need.
#pragma once

#include "magshell/core/simd_double.h"
#include "magshell/core/types.h"

namespace magshell {

struct SimdVec3 {
    SimdDouble x, y, z;

    SimdVec3& operator+=(const SimdVec3& b) {
        x += b.x;
        y += b.y;
        z += b.z;
        return *this;
    }
    SimdVec3& operator-=(const SimdVec3& b) {
        x -= b.x;
        y -= b.y;
        z -= b.z;
        return *this;
    }

    friend SimdVec3 operator+(const SimdVec3& a, const SimdVec3& b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend SimdVec3 operator-(const SimdVec3& a, const SimdVec3& b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend SimdVec3 operator-(const SimdVec3& a) { return {-a.x, -a.y, -a.z}; }
    friend SimdVec3 operator*(const SimdDouble& s, const SimdVec3& a) { return {s * a.x, s * a.y, s * a.z}; }
};

/// Returns a SIMD vector with the same vector in every lane.
inline SimdVec3 broadcast(const Vec3& v) {
    return {SimdDouble(v.x()), SimdDouble(v.y()), SimdDouble(v.z())};
}

inline SimdDouble dot(const SimdVec3& a, const SimdVec3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline SimdVec3 cross(const SimdVec3& a, const SimdVec3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline SimdDouble squared_norm(const SimdVec3& a) {
    return dot(a, a);
}

/// A 3 x 3 matrix in row-major order: at[3 * row + column].
struct SimdMat3 {
    SimdDouble at[9];

    SimdMat3& operator+=(const SimdMat3& b) {
        for (int k = 0; k < 9; ++k) at[k] += b.at[k];
        return *this;
    }
    SimdMat3& operator-=(const SimdMat3& b) {
        for (int k = 0; k < 9; ++k) at[k] -= b.at[k];
        return *this;
    }
    friend SimdMat3 operator+(const SimdMat3& a, const SimdMat3& b) {
        SimdMat3 sum;
        for (int k = 0; k < 9; ++k) sum.at[k] = a.at[k] + b.at[k];
        return sum;
    }
    friend SimdMat3 operator-(const SimdMat3& a, const SimdMat3& b) {
        SimdMat3 difference;
        for (int k = 0; k < 9; ++k) difference.at[k] = a.at[k] - b.at[k];
        return difference;
    }
    friend SimdMat3 operator*(const SimdDouble& s, const SimdMat3& a) {
        SimdMat3 scaled;
        for (int k = 0; k < 9; ++k) scaled.at[k] = s * a.at[k];
        return scaled;
    }
    friend SimdMat3 operator-(const SimdMat3& a) { return SimdDouble(-1.0) * a; }
};

inline SimdMat3 transpose(const SimdMat3& a) {
    return {{a.at[0], a.at[3], a.at[6], a.at[1], a.at[4], a.at[7], a.at[2], a.at[5], a.at[8]}};
}

/// Returns a b^T.
inline SimdMat3 outer(const SimdVec3& a, const SimdVec3& b) {
    return {
        {a.x * b.x, a.x * b.y, a.x * b.z, a.y * b.x, a.y * b.y, a.y * b.z, a.z * b.x, a.z * b.y, a.z * b.z}};
}

/// Returns a b^T + b a^T.
inline SimdMat3 symmetric_outer(const SimdVec3& a, const SimdVec3& b) {
    const SimdDouble xy = a.x * b.y + a.y * b.x, xz = a.x * b.z + a.z * b.x, yz = a.y * b.z + a.z * b.y;
    const SimdDouble xx = a.x * b.x, yy = a.y * b.y, zz = a.z * b.z;
    return {{xx + xx, xy, xz, xy, yy + yy, yz, xz, yz, zz + zz}};
}

inline void add_to_diagonal(SimdMat3& a, const SimdDouble& s) {
    a.at[0] += s;
    a.at[4] += s;
    a.at[8] += s;
}

/// Returns [v], the matrix with [v] w = v x w.
inline SimdMat3 cross_matrix(const SimdVec3& v) {
    const SimdDouble zero(0.0);
    return {{zero, -v.z, v.y, v.z, zero, -v.x, -v.y, v.x, zero}};
}

inline SimdMat3 multiply(const SimdMat3& a, const SimdMat3& b) {
    SimdMat3 product;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            product.at[3 * r + c] =
                a.at[3 * r] * b.at[c] + a.at[3 * r + 1] * b.at[3 + c] + a.at[3 * r + 2] * b.at[6 + c];
    return product;
}

}  // namespace magshell
