"""Toolpaths of any program, read from files: tables, G-code, APT, RAPID, bundles; a format is one file."""

from geoprint.toolpath_files.path_file import PathFile as PathFile
from geoprint.toolpath_files.reading import read_paths as read_paths
