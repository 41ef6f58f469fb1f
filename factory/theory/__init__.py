"""The paper and what continues it: products, language, nets, compiler, control. It needs neither an
engine nor meshes."""
