"""Loads, pressures, surface tension and water."""
