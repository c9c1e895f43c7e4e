"""What is done ahead of its turn, beside the first run after an installation."""

from geoprint.pipeline.ahead.compiling import compiled_ahead as compiled_ahead
