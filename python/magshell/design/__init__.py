"""Minimizing over designs."""
