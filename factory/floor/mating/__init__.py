"""How the inputs of each operation can come together, from the PAG and the meshes alone."""
