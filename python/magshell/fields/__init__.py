"""Applied magnetic fields."""
