"""What an executed program commands, for a print in silico."""

from geoprint.export.rapid.simulated.dispensing import dispensing_of as dispensing_of
