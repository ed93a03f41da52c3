"""The bodies of a scene together: their numbering, their joined mesh and their ties."""
