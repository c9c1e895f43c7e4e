"""The live view as a user meets it, in a headless browser that draws without a graphics card."""
