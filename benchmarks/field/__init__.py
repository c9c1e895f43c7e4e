"""The yardstick of the field: every planner's paths on the same parts, judged by one measure."""
