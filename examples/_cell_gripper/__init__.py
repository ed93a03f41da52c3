"""Pictures of the example cell_gripper. The gripper itself is magshell.envs.cell_gripper."""
