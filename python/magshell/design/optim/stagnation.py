"""Message of the optimizers if a step changes nothing. Needs no torch."""

STAGNATION = "the optimizer finds no lower design, to rounding"
