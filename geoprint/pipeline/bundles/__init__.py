"""Bundles that stand on the disk: what they hold, planned again, checked again from end to end, seen to run."""
