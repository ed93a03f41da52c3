"""Defines loads, pressures, surface tension and water."""
