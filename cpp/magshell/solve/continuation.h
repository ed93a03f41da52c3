// Paths of equilibria: pseudo-arclength continuation in the controls, through limit points, with critical
// points located.
//
// A point is a state and a parameter, 0 at the old controls and 1 at the new. Lengths are measured by
//
//   ds^2 = |dx|^2 / extent^2 + psi^2 dlambda^2          |.|: root mean square over the sheet's area
//
// with psi such that both parts weigh the same at the start. Corrections are mixed Newton steps perpendicular
// to the tangent.
#pragma once

#include <functional>
#include <vector>

#include "magshell/solve/newton.h"
#include "magshell/solve/statics.h"

namespace magshell {

struct PathOptions {
    NewtonOptions newton;
    double first_step = 0.05;    // of the parameter
    double largest_step = 0.02;  // of the arc length: root mean square displacement over the sheet's extent
    int max_points = 1000;
    double lowest_parameter = -1e300, highest_parameter = 1.0;
    bool locate_critical = true;
};

struct PathPoint {
    VectorXd state;
    double parameter = 0.0;
    Model::Turns turns;
    Index unstable_directions = 0;
};

enum class CriticalKind { limit, bifurcation };

struct CriticalPoint {
    PathPoint point;
    CriticalKind kind;
    VectorXd mode;      // all unknowns
    Index after_point;  // index of the last path point before it
};

struct PathResult {
    Outcome outcome = Outcome::failed;
    std::vector<PathPoint> points;
    std::vector<CriticalPoint> critical;
    std::string reason;  // why it ended
    int iterations = 0, factorizations = 0, failed_factorizations = 0;
};

/// Called with every accepted point; true ends the path there.
using Until = std::function<bool(const PathPoint&)>;

/// From an equilibrium at `from`, following the controls towards `to`; the numbers of what varies follow the others
/// in both.
PathResult follow_path(Model& model, const VectorXd& start, const Model::Turns& turns, const Controls& from,
                       const Controls& to, const PathOptions& options, const Until& until,
                       const StaticsWatch& watch = {}, const Varying& varying = {});

}  // namespace magshell
