"""Joint trajectories as CSV and ROS 2 YAML with timed outputs: written, read back and played."""
