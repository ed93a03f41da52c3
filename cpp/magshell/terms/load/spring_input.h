// SpringsInput: the description of springs that share their parameters.
#pragma once

#include <string>
#include <vector>

#include "magshell/core/types.h"

namespace magshell {

struct SpringsInput {
    struct Spring {
        // The vector along the spring is t = sum_j weights_j x_j - g, with its ground point g, or zero if both ends are on bodies.
        std::vector<Index> vertices;  // of the caller
        std::vector<double> weights;
        Vec3 direction = Vec3::Zero();  // unit vector, if the spring acts along a fixed direction; else zero
        double share = 1.0;             // factor of stiffness and damping, such as an area [m2]
        Index number = 0;               // among the caller's springs; several may have the same
        Vec3 ground = Vec3::Zero();     // g [m]
    };
    std::string owner;  // name under which their parameters are registered
    std::vector<Spring> springs;
    // Rows of each parameter: one for all springs, or one for each number; 0: not there.
    Index stiffness_rows = 1, rest_length_rows = 0, damping_rows = 0, ground_rows = 0;
    std::string stiffness_unit, damping_unit;
    // Whether share, direction and ground point of each spring are parameters, as where they follow from rest positions.
    bool has_places = false;
};

}  // namespace magshell
