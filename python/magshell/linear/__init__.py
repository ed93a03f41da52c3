"""Linear theory: small deflections, buckling, vibrations."""
