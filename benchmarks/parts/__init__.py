"""What several benchmarks share: surfaces by formula, discs of hearts, bodies, and tables."""
