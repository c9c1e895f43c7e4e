"""Package data: the arms as URDF and the cells as TOML."""
