"""Folders of several bundles: what stands beside these, checked with all of them; the program of a stack."""
