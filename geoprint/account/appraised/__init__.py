"""What is said of photographs of a print: figures, tables and pictures; the text stands with the texts."""
