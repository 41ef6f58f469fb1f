"""What stands on the floor: shapes, how parts come together, layouts with hands, modes and their times."""
