"""Defines muscles, cavities, pneumatic cells and tendons."""
