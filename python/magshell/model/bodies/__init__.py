"""Puts the bodies of a scene together, and finds what a result says of each."""
