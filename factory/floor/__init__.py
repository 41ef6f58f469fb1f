"""What stands on the floor: robot types, shapes, how parts come together, layouts with hands, and
modes.

In the order of a run of the compiler: `robots/catalogue.py` (`load_catalogue`) reads robot types,
`geometry/product.py` (`product_geometry`) makes a solid of each part, `mating/mating.py`
(`matings`) finds how inputs come together, `layout/embedding.py` (`lay_out`) finds a layout,
`layout/clearance.py` (`certify`) certifies it, and `modes/modes.py` (`operation_modes`) makes its
modes.
"""
