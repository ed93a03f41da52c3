"""Results of single bodies, joints and actuators."""
