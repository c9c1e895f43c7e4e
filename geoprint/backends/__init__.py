"""Planning backends: each covers a surface with curves a constant distance apart, behind one interface."""
