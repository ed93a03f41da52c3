"""The parts of examples/fish.py: the search for its torques, pictures. The fish itself is in robots.fish."""
