"""Solves for equilibria, motions, linear responses and their gradients."""
