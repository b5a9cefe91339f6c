"""Bit-accurate reference of every hardware block: integers in, the same integers as the RTL out."""
