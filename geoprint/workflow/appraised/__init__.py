"""Photographs and scans of a print, read, appraised, held against a bundle, and written."""
