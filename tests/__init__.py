"""Tests of geoprint."""
