// The gradient of a number by everything a solve takes: SceneValues, the magnetization and the controls,
// shaped like them.
#pragma once

#include <vector>

#include "magshell/assembly/motion.h"
#include "magshell/assembly/placed_obstacle.h"
#include "magshell/energy/contact.h"
#include "magshell/energy/controls.h"
#include "magshell/force/drag.h"

namespace magshell {

/// In the caller's numbering; a scene without loads, gravity, couples or motions leaves theirs empty.
struct SceneGradient {
    VectorXd thickness, young_modulus, poisson_ratio;  // one a face
    VectorXd curvature_scale;                          // one an edge
    Rows3 remanent_magnetization;                      // one a face
    VectorXd weights, loads;                           // by forces, three a node: the core's numbering
    VectorXd couples;
    std::vector<Motion> motions;
    std::vector<VectorXd> field_sources;  // of each source, by its own parameters
    std::vector<ContactLaw> contacts;
    std::vector<Placement> obstacles;
    Drag::Gradient water;
    Controls controls;

    /// Adds another one, or a part of one, but for the controls: those of a motion are many.
    void add_scene(const SceneGradient& part);
};

}  // namespace magshell
