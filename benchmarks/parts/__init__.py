"""What benchmarks are made of: surfaces by formula, discs of hearts, bodies, and tables."""
