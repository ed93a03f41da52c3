"""What examples/shell_against_volume.py is made of: deformations, energies, tables and pictures."""
