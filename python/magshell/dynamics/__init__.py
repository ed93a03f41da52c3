"""Motions of a scene."""
