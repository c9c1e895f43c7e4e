"""What is said of photographs and scans of a print: figures, tables and pictures; the text stands with the texts."""
