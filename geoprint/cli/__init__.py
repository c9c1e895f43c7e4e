"""The command line: parse, call the API, print or write. Heavy imports wait until a command runs.

A person reads stderr; stdout carries results only (`--json`). Every refusal is one sentence and an exit status.
"""

from geoprint.cli.ending import main as main
