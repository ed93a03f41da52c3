"""Equilibria of a scene: one, many load cases, paths, designs that change."""
