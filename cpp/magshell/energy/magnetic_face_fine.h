// The Zeeman energy of a magnetized triangle in a field that is sampled at several points of its plane and of its thickness.
//
//   E_f = - A~ h sum_p w_p M . B(x_p),   x_p = sum_a s_pa y_a,   y = (x_0, x_1, x_2, n),   s_p = (barycentric coordinates, zeta_p)
//
// with the height zeta_p [m] over the middle surface; M is that of magnetic_face.h. The samples enter through their moments only
//
//   B = sum_p w_p B(x_p),   G_a = sum_p w_p s_pa dB/dx,   C_ab = sum_p w_p s_pa s_pb d2(M . B)/dx2
//
// so that with N_k = dn/dx_k and D_ak = (dM/dx_k)^T G_a
//
//   dE/dx_k      = - A~ h (dM/dx_k^T B + G_k^T M + N_k^T G_3^T M)
//   d2E/dx_k dx_l = d2E/dx_k dx_l at fixed B - A~ h (D_lk + D_kl^T + C_kl + Q_k N_l + N_k^T Q_l^T) + d2(n . c)/dx_k dx_l
//   Q_k = D_3k + C_k3 + C_33 N_k^T / 2 (with N_k^T in front),   c = - A~ h G_3^T M held fixed
#pragma once

#include "magshell/energy/magnetic_face.h"

namespace magshell {

/// The moments of the samples of a face. Gradients and curvatures are set as in FieldAtPoint.
struct FieldOverFace {
    SimdVec3 flux;           // B [T]
    SimdMat3 gradient[4];    // G_a [T/m], [T] for the normal
    SimdMat3 curvature[10];  // C_ab, at lower_index(a, b)
};

namespace magnetic_face_fine {

/// Returns c = - A~ h G_3^T M, the gradient with respect to the normal for a fixed M.
template <class Law>
SimdVec3 by_normal(const Law& face, const typename Law::Element& e, const FieldOverFace& field) {
    return -e.volume * transposed_times(field.gradient[3], face.magnetization(e));
}

template <class Law>
void gradient(const Law& face, const typename Law::Element& e, const FieldOverFace& field, SimdVec3 g[3]) {
    face.gradient(e, field.flux, g);
    const SimdVec3 m = face.magnetization(e), p = face.tangential(by_normal(face, e, field));
    const SimdVec3 by1 = cross(face.a2, p), by2 = cross(p, face.a1);
    for (int k = 0; k < 3; ++k) g[k] += -e.volume * transposed_times(field.gradient[k], m);
    g[0] += -(by1 + by2);
    g[1] += by1;
    g[2] += by2;
}

/// Computes the lower blocks at lower_index(k, l).
template <class Law>
void hessian(const Law& face, const typename Law::Element& e, const FieldOverFace& field, SimdMat3 h[6]) {
    face.hessian(e, field.flux, h);

    SimdMat3 h11, h12, h22, of_normal[6];
    face.normal_hessian(SimdDouble(1.0), by_normal(face, e, field), h11, h12, h22);
    Law::node_blocks(h11, h12, h22, of_normal);

    SimdMat3 normal[3];  // N_k^T
    face.normal_by_nodes(normal);

    SimdMat3 mixed[4][3];  // D_ak
    for (int a = 0; a < 4; ++a) face.by_node(e, field.gradient[a], mixed[a]);
    const SimdMat3& twice = field.curvature[lower_index(3, 3)];
    SimdMat3 q[3];
    for (int k = 0; k < 3; ++k)
        q[k] =
            mixed[3][k] + field.curvature[lower_index(3, k)] + SimdDouble(0.5) * multiply(normal[k], twice);
    for (int k = 0; k < 3; ++k)
        for (int l = 0; l <= k; ++l)
            h[lower_index(k, l)] +=
                of_normal[lower_index(k, l)] -
                e.volume * (mixed[l][k] + transpose(mixed[k][l]) + field.curvature[lower_index(k, l)] +
                            multiply(q[k], transpose(normal[l])) + multiply(normal[k], transpose(q[l])));
}

}  // namespace magnetic_face_fine
}  // namespace magshell
