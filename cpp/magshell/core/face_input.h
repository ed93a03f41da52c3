// A number that each face of a surface has for an energy: its name and unit among the parameters.
#pragma once

namespace magshell {

struct FaceInput {
    const char *name, *unit;
};

}  // namespace magshell
