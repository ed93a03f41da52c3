// Three-vectors and 3 x 3 matrices of packs, with the operations that element kernels need.
#pragma once

#include "magshell/core/pack.h"
#include "magshell/core/types.h"

namespace magshell {

struct Pack3 {
    Pack x, y, z;

    Pack3& operator+=(const Pack3& b) {
        x += b.x;
        y += b.y;
        z += b.z;
        return *this;
    }
    Pack3& operator-=(const Pack3& b) {
        x -= b.x;
        y -= b.y;
        z -= b.z;
        return *this;
    }

    friend Pack3 operator+(const Pack3& a, const Pack3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend Pack3 operator-(const Pack3& a, const Pack3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Pack3 operator-(const Pack3& a) { return {-a.x, -a.y, -a.z}; }
    friend Pack3 operator*(const Pack& s, const Pack3& a) { return {s * a.x, s * a.y, s * a.z}; }
};

/// Returns a pack with the same vector in every lane.
inline Pack3 broadcast(const Vec3& v) {
    return {Pack(v.x()), Pack(v.y()), Pack(v.z())};
}

inline Pack dot(const Pack3& a, const Pack3& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

inline Pack3 cross(const Pack3& a, const Pack3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline Pack squared_norm(const Pack3& a) {
    return dot(a, a);
}

/// A 3 x 3 matrix in row-major order: at[3 * row + column].
struct Pack33 {
    Pack at[9];

    Pack33& operator+=(const Pack33& b) {
        for (int k = 0; k < 9; ++k) at[k] += b.at[k];
        return *this;
    }
    Pack33& operator-=(const Pack33& b) {
        for (int k = 0; k < 9; ++k) at[k] -= b.at[k];
        return *this;
    }
    friend Pack33 operator+(const Pack33& a, const Pack33& b) {
        Pack33 sum;
        for (int k = 0; k < 9; ++k) sum.at[k] = a.at[k] + b.at[k];
        return sum;
    }
    friend Pack33 operator-(const Pack33& a, const Pack33& b) {
        Pack33 difference;
        for (int k = 0; k < 9; ++k) difference.at[k] = a.at[k] - b.at[k];
        return difference;
    }
    friend Pack33 operator*(const Pack& s, const Pack33& a) {
        Pack33 scaled;
        for (int k = 0; k < 9; ++k) scaled.at[k] = s * a.at[k];
        return scaled;
    }
    friend Pack33 operator-(const Pack33& a) { return Pack(-1.0) * a; }
};

inline Pack33 transpose(const Pack33& a) {
    return {{a.at[0], a.at[3], a.at[6], a.at[1], a.at[4], a.at[7], a.at[2], a.at[5], a.at[8]}};
}

/// Returns a b^T.
inline Pack33 outer(const Pack3& a, const Pack3& b) {
    return {
        {a.x * b.x, a.x * b.y, a.x * b.z, a.y * b.x, a.y * b.y, a.y * b.z, a.z * b.x, a.z * b.y, a.z * b.z}};
}

/// Returns a b^T + b a^T.
inline Pack33 symmetric_outer(const Pack3& a, const Pack3& b) {
    const Pack xy = a.x * b.y + a.y * b.x, xz = a.x * b.z + a.z * b.x, yz = a.y * b.z + a.z * b.y;
    const Pack xx = a.x * b.x, yy = a.y * b.y, zz = a.z * b.z;
    return {{xx + xx, xy, xz, xy, yy + yy, yz, xz, yz, zz + zz}};
}

inline void add_to_diagonal(Pack33& a, const Pack& s) {
    a.at[0] += s;
    a.at[4] += s;
    a.at[8] += s;
}

/// Returns [v], the matrix with [v] w = v x w.
inline Pack33 cross_matrix(const Pack3& v) {
    const Pack zero(0.0);
    return {{zero, -v.z, v.y, v.z, zero, -v.x, -v.y, v.x, zero}};
}

inline Pack33 multiply(const Pack33& a, const Pack33& b) {
    Pack33 product;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
            product.at[3 * r + c] =
                a.at[3 * r] * b.at[c] + a.at[3 * r + 1] * b.at[3 + c] + a.at[3 * r + 2] * b.at[6 + c];
    return product;
}

}  // namespace magshell
