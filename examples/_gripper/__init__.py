"""Parts of the example gripper."""
