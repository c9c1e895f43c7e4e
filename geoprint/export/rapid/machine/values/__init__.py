"""What RAPID computes with: records, poses, operators, what every controller declares, and its errors."""
