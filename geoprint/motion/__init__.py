"""From poses to a checked trajectory: placement, kinematics, timing and clearance. Metres stay inside."""
