"""What is said of a stack of layers, and its page."""
