"""The parts of examples/letters.py and examples/banner.py: glyphs, the task, the designs, tiles, pictures."""
