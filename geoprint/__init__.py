"""Plan evenly spaced print paths on curved surfaces and write the robot program that prints them."""
