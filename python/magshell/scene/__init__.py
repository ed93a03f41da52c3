"""The scene: its bodies and surroundings put together, and the values a solve may replace."""
