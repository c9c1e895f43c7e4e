"""A backend, a pattern, a report, a command and a reader for geoprint, from outside."""
