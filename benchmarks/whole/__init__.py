"""What the whole costs, beside an earlier commit and beside peers."""
