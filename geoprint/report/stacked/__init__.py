"""The page of a stack: its figures, its scene and what they show."""
