"""A mesh worth planning on: reading, preparing, topology, operators and refinement."""
