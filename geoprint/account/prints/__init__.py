"""What is said of prints before they are made."""
