"""Holds the force of a muscle over its rate."""

import numpy as np

RATES = np.linspace(-1, 1, 9)
FORCE_VELOCITY = np.stack([RATES, 1.0 + 0.5 * np.tanh(2 * RATES)], axis=1)
