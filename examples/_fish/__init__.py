"""What examples/fish.py is made of: the search for its torques, pictures. The fish itself is robots.fish."""
