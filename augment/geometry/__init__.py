"""Plane geometry on plain numbers: metres, radians, counter-clockwise from +x."""
