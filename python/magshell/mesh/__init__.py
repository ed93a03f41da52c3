"""Triangle meshes and tetrahedral meshes: data structures, generators, files."""
