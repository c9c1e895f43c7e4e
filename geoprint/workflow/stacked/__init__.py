"""What is kept of the layers of a stack, and how it comes out when all of them are printed."""
