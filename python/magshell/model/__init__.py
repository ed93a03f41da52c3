"""The description of a scene: bodies, actuators, supports, loads, contacts and fields."""
