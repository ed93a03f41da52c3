"""Minimizes objectives over designs, with optimizers, controls in time and many starts."""
