"""Fits of a model to data: estimates with intervals, what the data do not determine, tests of the residuals."""
