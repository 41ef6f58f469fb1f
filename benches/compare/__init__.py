"""This project beside what others publish, and beside itself with something taken out."""
