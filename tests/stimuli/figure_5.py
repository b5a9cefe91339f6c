"""The founding paper's Figure 5, read off by eye: the largest stable K in kN/m at every step of B, by method."""

PAPER = {
    "fdm-30": [4, 5, 3, 0],
    "fdm-100": [8, 11, 12, 12, 10, 8, 5, 2, 0],
    "fdm-500": [10, 14, 19, 22, 25, 27, 28, 27, 25, 23, 20, 15, 8, 0],
    "fdm-1000": [10, 14, 19, 22, 25, 27, 29, 28, 26, 23, 19, 14, 7, 0],
    "proposed": [12, 18, 24, 28, 30, 30, 29, 27, 25, 0],
    "adjusted": [13, 20, 27, 33, 38, 42, 45, 47, 48, 48, 0],
}
