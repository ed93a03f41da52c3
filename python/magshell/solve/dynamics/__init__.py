"""Simulates motions of scenes."""
