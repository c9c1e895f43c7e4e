"""What a person reads in a terminal of a plan, a comparison and a calibration; the figures stand beside this wing."""
