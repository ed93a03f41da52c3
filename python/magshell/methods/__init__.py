"""How equilibria are looked for and time steps are taken: options as objects."""
