"""The arm's motion from poses to a checked trajectory: kinematics, reach, timing, clearance. Metres stay inside."""
