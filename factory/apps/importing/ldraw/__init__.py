"""LDraw models (.ldr, .mpd): nested sub-models and building steps as a tree of assemblies.

After the LDraw file format 1.0.2, the MPD and the BFC language extensions, https://www.ldraw.org/
article/218.html. Lengths there are LDU of 0.4 mm, and -y is up.
"""
