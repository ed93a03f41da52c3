"""The parts of examples/shell_against_volume.py: deformations, energies, tables and pictures."""
