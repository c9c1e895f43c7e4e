"""Measured figures: every number in the README comes out of a script here. Public API only."""
