"""Pictures of the example muscle_octopus. The octopus itself is robots.muscle_octopus."""
