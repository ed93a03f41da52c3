"""The figures of [Chen22] Table 1, Heart (top) and (bottom)."""

FACES, TETRAHEDRA = 1326, 1963
VARIABLES = (1400, 500)
SECONDS = (560 / 72, 920 / 42)  # an iteration, on six cores
