"""Defines what results say of each body."""
