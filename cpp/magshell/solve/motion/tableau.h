// Diagonally implicit Runge-Kutta methods with equal diagonal coefficients that are stiffly accurate: the last stage is the end of the step.
// Stage i of a step from (x, v) solves for v_i and its rate w_i
//
//   x_i = x + dt sum_j a_ij v_j,   v_i = v + dt sum_j a_ij w_j,   M w_i = f(x_i, v_i, t + c_i dt)     j <= i
//
// Dofs without mass, the edge rotations, are therefore in equilibrium in every stage and at the end. A method with an explicit first
// stage uses the rates at the end of the previous step as its first column, and needs another method to start.
//
// Contact may be implicit within a method, as Kane et al. 1999 make it implicit within Newmark's: contact and friction at the end of a stage
// act from the beginning of the step to the end of the stage, in the place of those of all stages until then,
//
//   v_i = v + dt sum_j a_ij e_j + c_i dt C_i             C: acceleration by contact and friction, e: by all other forces
//
// Constant contact forces are then integrated exactly, and impacts that no step resolves lose energy. The equation of a stage keeps
// its form, M w_i = f_e + (c_i/a_ii) f_C with w_i = e_i + (c_i/a_ii) C_i. Implicit Euler does not change.
#pragma once

namespace magshell {

struct Tableau {
    // Stages of a method, at most, without an explicit first one; see test_order_in_time.
    static constexpr int max_stages = 3;

    int stages = 1;  // implicit ones
    double diagonal = 1.0;
    bool begins_explicitly = false;
    bool implicit_contact = false;
    double a[max_stages][max_stages + 1] = {{1.0}};

    /// Returns the time of stage i, as a fraction of the step.
    double time(int i) const {
        double c = 0.0;
        for (int j = 0; j <= i + (begins_explicitly ? 1 : 0); ++j) c += a[i][j];
        return i + 1 == stages ? 1.0 : c;
    }
    /// Returns c_i/a_ii if contact is implicit, else 1.
    double contact_factor(int i) const { return implicit_contact ? time(i) / diagonal : 1.0; }
};

inline Tableau implicit_euler() {
    return {};
}

/// Returns SDIRK2 [Alexander 1977]: two stages, second order, L-stable.
inline Tableau sdirk2() {
    // [-] Coefficients of the method; see test_order_in_time.
    constexpr double g = 0.29289321881345247560;  // 1 - 1/sqrt(2)
    return {2, g, false, false, {{g}, {1.0 - g, g}}};
}

/// Returns SDIRK3 [Alexander 1977]: three stages, third order, L-stable.
inline Tableau sdirk3() {
    // [-] Coefficients of the method; see test_order_in_time.
    constexpr double g = 0.43586652150845899942;  // g^3 - 3 g^2 + 3/2 g - 1/6 = 0
    constexpr double b1 = 1.20849664917601;       // (-6 g^2 + 16 g - 1) / 4; see test_order_in_time
    constexpr double b2 = -0.6443631706844692;    // (6 g^2 - 20 g + 5) / 4; see test_order_in_time
    return {3, g, false, false, {{g}, {0.5 * (1.0 - g), g}, {b1, b2, g}}};
}

/// Returns TR-BDF2 [Bank et al. 1985; Hosea and Shampine 1996]: the trapezoidal rule to 2 - sqrt(2) of the step, then BDF2. It is of second
/// order, L-stable, and every stage is of second order too.
inline Tableau tr_bdf2() {
    // [-] Coefficients of the method; see test_order_in_time.
    constexpr double g = 0.29289321881345247560, w = 0.35355339059327376220;  // 1 - 1/sqrt(2), sqrt(2)/4
    return {2, g, true, false, {{g, g}, {w, w, g}}};
}

}  // namespace magshell
