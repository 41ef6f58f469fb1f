"""What stands on the floor: shapes, how parts come together, layouts with hands, and modes."""
