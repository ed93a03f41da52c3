"""Muscles, cavities, pneumatic cells and tendons."""
