"""The triangle mesh: selections, quality, joining, files."""
