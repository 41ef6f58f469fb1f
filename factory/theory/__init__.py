"""The paper and what continues it: products, language, nets, compiler, control. It needs neither an
engine nor meshes.

In the order of reading: `problem/pag.py` (`PAG`), `lang/pag_reader.py` (`read_pag`),
`nets/gears.py` (`GearNet`) and `nets/verify.py` (`verify`), `control/navigation.py`
(`Bundle.field`), `plant/factory.py` (`Factory`), `compiler/compiler.py` (`compile_pag`).
"""
