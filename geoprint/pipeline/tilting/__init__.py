"""Plans over a table that tilts the part."""

from geoprint.pipeline.tilting.division import with_table as with_table
