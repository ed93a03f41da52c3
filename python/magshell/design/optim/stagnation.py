"""What optimizers say where a step moves nothing. Needs no torch."""

STANDSTILL = "the optimizer finds no lower design, to rounding"
