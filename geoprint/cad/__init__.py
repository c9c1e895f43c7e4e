"""CAD files: the faces of STEP and IGES, tessellated."""
