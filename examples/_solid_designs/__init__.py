"""What the designs of solids share: a magnetization carried from mesh to mesh, and the table of what it does there."""
