"""RAPID as people write it: text becomes syntax, and the names of a whole task are resolved."""
