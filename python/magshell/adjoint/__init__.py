"""The way back from results to inputs."""
