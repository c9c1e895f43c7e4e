"""What leaves geoprint: RAPID modules, tables and the bundle on disk, each verified before it counts."""
