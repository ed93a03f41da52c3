"""The same optimization from many starts."""
