"""Fast marching of a front that carries its direction."""

from geoprint.backends.marching.backend import FastMarching as FastMarching
