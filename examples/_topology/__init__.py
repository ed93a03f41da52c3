"""Parts of topology.py."""
