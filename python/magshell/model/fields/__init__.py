"""Defines applied magnetic fields."""
