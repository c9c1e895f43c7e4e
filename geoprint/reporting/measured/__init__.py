"""What is said of measured toolpaths: figures, report page and picture; the table stands with the texts."""
