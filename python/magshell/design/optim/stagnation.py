"""What optimizers say where a step moves nothing. Needs no torch."""

STAGNATION = "the optimizer finds no lower design, to rounding"
