"""Parts of the example jumping_starfish."""
