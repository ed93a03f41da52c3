"""Defines contact of bodies with obstacles, with each other and with themselves."""
