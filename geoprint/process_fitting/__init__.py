"""Process settings from measurements: the fluid that measured lines fit, and what fits a pressure."""
