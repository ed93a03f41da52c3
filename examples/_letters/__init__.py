"""What examples/letters.py and examples/banner.py are made of: glyphs, the task, the designs, tiles, pictures."""
