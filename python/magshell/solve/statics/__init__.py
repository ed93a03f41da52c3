"""Solves for equilibria: one, load cases, paths, several stable ones."""
