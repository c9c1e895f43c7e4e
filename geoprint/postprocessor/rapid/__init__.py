"""RAPID: written, read, executed and verified; what reads and executes shares no code with the writer."""
