"""Pictures of the example cell_gripper. The gripper itself is robots.cell_gripper."""
