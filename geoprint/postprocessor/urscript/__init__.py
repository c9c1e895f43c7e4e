"""URScript for arms of Universal Robots: written, read back, executed frame by frame, and held against the plan."""
