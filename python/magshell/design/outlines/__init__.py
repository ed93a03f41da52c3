"""Outlines of sheets by a few numbers, with a mesh inside that follows them, and that is made anew where it is worn."""
