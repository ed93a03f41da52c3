"""Pictures of the example muscle_octopus. The octopus itself is magshell.envs.muscle_octopus."""
