"""Contact of bodies with obstacles, with each other and with themselves."""
