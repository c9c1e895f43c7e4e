"""What a comparison of plans shows of them, quantity by quantity."""
