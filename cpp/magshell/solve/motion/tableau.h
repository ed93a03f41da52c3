// Diagonally implicit Runge-Kutta methods with equal diagonal coefficients that are stiffly accurate: the last stage is the end of the step.
// Stage i of a step from (x, v) solves for v_i and its rate w_i
//
//   x_i = x + dt sum_j a_ij v_j,   v_i = v + dt sum_j a_ij w_j,   M w_i = f(x_i, v_i, t + c_i dt)     j <= i
//
// Dofs without mass, the edge rotations, are therefore in equilibrium in every stage and at the end. A method with an explicit first
// stage uses the rates at the end of the previous step as its first column, and needs another method to start.
#pragma once

namespace magshell {

struct Tableau {
    // Stages of a method, at most, without an explicit first one; see test_order_in_time.
    static constexpr int max_stages = 3;

    int stages = 1;  // implicit ones
    double diagonal = 1.0;
    bool begins_explicitly = false;
    double a[max_stages][max_stages + 1] = {{1.0}};

    /// Returns the time of stage i, as a fraction of the step.
    double time(int i) const {
        double c = 0.0;
        for (int j = 0; j <= i + (begins_explicitly ? 1 : 0); ++j) c += a[i][j];
        return i + 1 == stages ? 1.0 : c;
    }
};

inline Tableau implicit_euler() {
    return {};
}

/// Returns SDIRK2 [Alexander 1977]: two stages, second order, L-stable.
inline Tableau sdirk2() {
    // [-] Coefficients of the method; see test_order_in_time.
    constexpr double g = 0.29289321881345247560;  // 1 - 1/sqrt(2)
    return {2, g, false, {{g}, {1.0 - g, g}}};
}

/// Returns SDIRK3 [Alexander 1977]: three stages, third order, L-stable.
inline Tableau sdirk3() {
    // [-] Coefficients of the method; see test_order_in_time.
    constexpr double g = 0.43586652150845899942;  // g^3 - 3 g^2 + 3/2 g - 1/6 = 0
    constexpr double b1 = 1.20849664917601;       // (-6 g^2 + 16 g - 1) / 4; see test_order_in_time
    constexpr double b2 = -0.6443631706844692;    // (6 g^2 - 20 g + 5) / 4; see test_order_in_time
    return {3, g, false, {{g}, {0.5 * (1.0 - g), g}, {b1, b2, g}}};
}

/// Returns TR-BDF2 [Bank et al. 1985; Hosea and Shampine 1996]: the trapezoidal rule to 2 - sqrt(2) of the step, then BDF2. It is of second
/// order, L-stable, and every stage is of second order too.
inline Tableau tr_bdf2() {
    // [-] Coefficients of the method; see test_order_in_time.
    constexpr double g = 0.29289321881345247560, w = 0.35355339059327376220;  // 1 - 1/sqrt(2), sqrt(2)/4
    return {2, g, true, {{g, g}, {w, w, g}}};
}

}  // namespace magshell
