// Where points are that would be deep in obstacles: after a time step that goes on as before, and after Newton's.
//
// There a point is pushed by what its law gives for that depth, which may be many times what stops it: Newton's steps
// would halve the depth, again and again. What a vertex alone would do is known at once:
//
//   w (depth0 - depth) + N0 = N(depth)         w: inertia [N/m], N0: the force that is expected of it otherwise
#pragma once

#include "magshell/scene/model.h"
#include "magshell/term/contact_term.h"

namespace magshell {

/// How vertices move from q that obstacles push more than twice as hard as they will, along what they are free to do;
/// empty: none is. weights: those of an Anchor. expected: touches as ContactTerm has them, with these forces [N].
VectorXd landing(const Model& model, const VectorXd& q, const Controls& controls, const VectorXd& weights,
                 const std::vector<ContactTerm::ActiveContact>& expected);

/// What touched when the model was last evaluated, with the forces that a step p from there is to change linearly.
std::vector<ContactTerm::ActiveContact> after_step(const Model& model, const VectorXd& p);

}  // namespace magshell
