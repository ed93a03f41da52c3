"""The scene: its translation for the core, its state-dependent quantities, and the checks of a solve's inputs."""
