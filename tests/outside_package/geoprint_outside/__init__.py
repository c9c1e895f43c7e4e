"""A backend and a pattern for geoprint, from outside."""
