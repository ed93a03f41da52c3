"""Parts of the example muscle_strip."""
